//! What one sum has found of pairs of parcels, for the sums after it: who is near whom, and by which weight.
//!
//! Owns the notes and the memory that they may take, which is bounded. May use nothing but sizes of neighbours' lists. It
//! deliberately knows no kernel: what is noted is told by whoever notes it, and whoever finds no note looks for himself.

use super::near::LANES;
use crate::catalog::kernel::Radial;
use std::sync::{Arc, Mutex, PoisonError};

/// Pairs of a sheet.
const PAIRS: usize = 4096;

/// Pieces of a sheet, each of one parcel and candidates that were copied together.
const PIECES: usize = PAIRS / LANES;

/// Pairs of some parcels, one after the other.
struct Sheet {
    /// Numbers of candidates, as neighbours' lists have them.
    found: [u8; 2 * PAIRS],
    weights: [f64; PAIRS],
    /// Pairs of each piece.
    sizes: [u16; PIECES],
    n_pieces: usize,
}

impl Sheet {
    fn new() -> Box<Self> {
        Box::new(Self { found: [0; 2 * PAIRS], weights: [0.0; PAIRS], sizes: [0; PIECES], n_pieces: 0 })
    }
}

/// Sheets that nobody needs just now: those used last are taken first.
#[derive(Default)]
struct Stock {
    idle: Vec<Box<Sheet>>,
    /// How many more may be made.
    n_left: usize,
}

/// The memory of notes.
pub struct Sheets {
    stock: Mutex<Stock>,
    most: usize,
    /// Where more are to be had when all of these are in use.
    store: Option<Arc<Sheets>>,
}

impl Drop for Sheets {
    fn drop(&mut self) {
        if let Some(store) = self.store.take() {
            store.take_back(&mut self.stock.get_mut().unwrap_or_else(PoisonError::into_inner).idle);
        }
    }
}

impl Sheets {
    pub fn new(most_bytes: usize) -> Arc<Self> {
        let most = most_bytes / size_of::<Sheet>();
        Arc::new(Self { stock: Mutex::new(Stock { idle: Vec::new(), n_left: most }), most, store: None })
    }

    /// A small stock for one thread, which keeps what it has taken from the whole one until it ends: in the cache of one core
    /// the same sheets serve again and again.
    pub fn of_thread(store: &Arc<Self>) -> Self {
        Self { stock: Mutex::default(), most: store.most, store: Some(store.clone()) }
    }

    pub fn most(&self) -> usize {
        self.most
    }

    /// How many can still be taken.
    pub fn n_left(&self) -> usize {
        let stock = self.stock.lock().unwrap_or_else(PoisonError::into_inner);
        stock.idle.len() + stock.n_left + self.store.as_ref().map_or(0, |store| store.n_left())
    }

    fn take(&self) -> Option<Box<Sheet>> {
        let mut stock = self.stock.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(sheet) = stock.idle.pop() {
            return Some(sheet);
        }
        if let Some(store) = &self.store {
            return store.take();
        }
        stock.n_left = stock.n_left.checked_sub(1)?;
        drop(stock);
        Some(Sheet::new())
    }

    fn take_back(&self, sheets: &mut Vec<Box<Sheet>>) {
        self.stock.lock().unwrap_or_else(PoisonError::into_inner).idle.append(sheets);
    }
}

/// The pairs of the parcels of a portion, in the order in which they were found.
#[derive(Default)]
pub struct Note {
    sheets: Vec<Box<Sheet>>,
    /// Pairs in the last sheet.
    n_pairs: usize,
    is_whole: bool,
    /// Where the first of all candidates stands, and the last, and one.
    pub span: (usize, usize),
}

impl Note {
    pub fn is_whole(&self) -> bool {
        self.is_whole
    }

    pub fn n_sheets(&self) -> usize {
        self.sheets.len()
    }

    pub fn forget(&mut self, sheets: &Sheets) {
        self.is_whole = false;
        self.span = (usize::MAX, 0);
        if !self.sheets.is_empty() {
            sheets.take_back(&mut self.sheets);
        }
    }

    /// An empty note that is whole as long as nothing is missing.
    pub fn begin(&mut self, sheets: &Sheets) {
        self.forget(sheets);
        self.is_whole = true;
        self.n_pairs = PAIRS;
    }

    /// Room for the next piece: numbers and weights of so many pairs. If there is none, all is forgotten.
    #[inline(always)]
    pub fn room(&mut self, n: usize, sheets: &Sheets) -> Option<(&mut [u8], &mut [f64])> {
        if self.n_pairs + n > PAIRS || self.sheets.last().is_none_or(|sheet| sheet.n_pieces == PIECES) {
            self.turn(sheets);
        }
        let at = self.n_pairs;
        let sheet = self.sheets.last_mut()?;
        sheet.sizes[sheet.n_pieces] = n as u16;
        sheet.n_pieces += 1;
        self.n_pairs += n;
        Some((&mut sheet.found[2 * at..2 * (at + n)], &mut sheet.weights[at..at + n]))
    }

    #[cold]
    #[inline(never)]
    fn turn(&mut self, sheets: &Sheets) {
        match sheets.take() {
            Some(mut sheet) => {
                sheet.n_pieces = 0;
                self.n_pairs = 0;
                self.sheets.push(sheet);
            }
            None => self.forget(sheets),
        }
    }

    pub fn read(&self) -> Reader<'_> {
        Reader { sheets: &self.sheets, piece: 0, at: 0 }
    }
}

/// Reads a note piece by piece.
pub struct Reader<'a> {
    sheets: &'a [Box<Sheet>],
    piece: usize,
    at: usize,
}

impl<'a> Reader<'a> {
    /// Numbers and weights of the next piece.
    #[inline(always)]
    pub fn next(&mut self) -> (&'a [u8], &'a [f64]) {
        if self.sheets.first().is_some_and(|sheet| sheet.n_pieces == self.piece) {
            self.sheets = &self.sheets[1..];
            (self.piece, self.at) = (0, 0);
        }
        let Some(sheet) = self.sheets.first() else { return (&[], &[]) };
        let start = self.at;
        self.at += usize::from(sheet.sizes[self.piece]);
        self.piece += 1;
        (&sheet.found[2 * start..2 * self.at], &sheet.weights[start..self.at])
    }
}

/// What the weights of all notes are.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Noted {
    #[default]
    Nothing,
    /// Values of the kernel.
    Values,
    /// What two exchange by.
    Forces,
}

/// All notes of a run, by portion.
pub struct Notes {
    pub of: Vec<Note>,
    pub sheets: Arc<Sheets>,
    pub noted: Noted,
}

impl Notes {
    pub fn new(sheets: Arc<Sheets>) -> Self {
        Self { of: Vec::new(), sheets, noted: Noted::Nothing }
    }

    /// All of them, and nothing is left.
    pub fn take(&mut self) -> Self {
        let none = Self::new(self.sheets.clone());
        std::mem::replace(self, none)
    }

    /// Whether there may be any.
    pub fn are_taken(&self) -> bool {
        self.sheets.most > 0
    }

    /// Parcels are elsewhere, or weights are to be others.
    pub fn forget(&mut self) {
        self.noted = Noted::Nothing;
        self.of.iter_mut().for_each(|note| note.forget(&self.sheets));
    }

    /// Whether they have what a sum is made of: forces or values.
    pub fn serve<K: Radial>(&self, _: K, is_by_forces: bool) -> bool {
        match self.noted {
            Noted::Nothing => false,
            Noted::Values => !is_by_forces || K::IS_ITS_OWN_FORCE,
            Noted::Forces => is_by_forces || K::IS_ITS_OWN_FORCE,
        }
    }

    /// What is known of a portion.
    pub fn whole(&self, idx: usize) -> Option<&Note> {
        self.of.get(idx).filter(|note| note.is_whole)
    }
}
