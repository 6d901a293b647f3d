//! What parcels brought in and took out, and what sides added to them.
//!
//! Owns the sums by door and column. May use nothing else of the crate but the engine's words. It deliberately
//! knows no species: columns are what is carried.

use super::super::react::Added;

/// Sums of one door and column, in units of concentration times particles.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Gain {
    pub entered: f64,
    pub left: f64,
}

impl Gain {
    fn add(&mut self, change: f64) {
        if change > 0.0 { self.entered += change } else { self.left -= change }
    }

    pub fn net(self) -> Added {
        Added { sum: self.entered - self.left, size: self.entered.abs() + self.left.abs() }
    }
}

/// What moved in a block within a step.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Moved {
    n_columns: usize,
    /// Per door and column.
    gains: Vec<Gain>,
    /// Per door the parcels that entered and left.
    parcels: Vec<[u64; 2]>,
}

impl Moved {
    /// A parcel has left with all it carries.
    pub fn leave(&mut self, door: usize, columns: &[Vec<f64>], idx: usize) {
        let own = &mut self.gains[door * self.n_columns..][..self.n_columns];
        for (gain, column) in own.iter_mut().zip(columns) {
            gain.left += column[idx];
        }
        self.parcels[door][1] += 1;
    }

    /// A side has changed what a parcel carries.
    pub fn change(&mut self, door: usize, column: usize, change: f64) {
        self.gains[door * self.n_columns + column].add(change);
    }
}

/// The books of a run. Doors are those of the plan: the start, sides, wells.
#[derive(Debug, Clone, PartialEq)]
pub struct Book {
    all: Moved,
    /// What additions lost to rounding, as `all`.
    lost: Vec<Gain>,
}

impl Book {
    pub fn new(n_doors: usize, n_columns: usize) -> Self {
        let gains = vec![Gain::default(); n_doors * n_columns];
        let parcels = vec![[0; 2]; n_doors];
        Self { lost: gains.clone(), all: Moved { n_columns, gains, parcels } }
    }

    pub fn n_columns(&self) -> usize {
        self.all.n_columns
    }

    /// Nothing moved yet.
    pub fn blank(&self) -> Moved {
        Moved {
            n_columns: self.all.n_columns,
            gains: vec![Gain::default(); self.all.gains.len()],
            parcels: vec![[0; 2]; self.all.parcels.len()],
        }
    }

    /// Parcels have come in with what they carry.
    pub fn enter(&mut self, door: usize, n_parcels: usize, columns: &[Vec<f64>]) {
        let mut moved = self.blank();
        moved.parcels[door][0] += n_parcels as u64;
        let own = &mut moved.gains[door * self.all.n_columns..][..self.all.n_columns];
        for (gain, column) in own.iter_mut().zip(columns) {
            gain.entered += column.iter().sum::<f64>();
        }
        self.take(&moved);
    }

    /// Adds what moved in a block, in the order of blocks.
    pub fn take(&mut self, moved: &Moved) {
        for ((sum, lost), part) in self.all.gains.iter_mut().zip(&mut self.lost).zip(&moved.gains) {
            add(&mut sum.entered, &mut lost.entered, part.entered);
            add(&mut sum.left, &mut lost.left, part.left);
        }
        for (sum, part) in self.all.parcels.iter_mut().flatten().zip(moved.parcels.iter().flatten()) {
            *sum += part;
        }
    }

    /// What came and went by a door, per column.
    pub fn gains(&self, door: usize) -> &[Gain] {
        &self.all.gains[door * self.all.n_columns..][..self.all.n_columns]
    }

    /// Parcels that entered and left by a door.
    pub fn parcels(&self, door: usize) -> [u64; 2] {
        self.all.parcels[door]
    }

    pub fn n_doors(&self) -> usize {
        self.all.parcels.len()
    }

    /// What came and went in all of a column.
    pub fn whole(&self, column: usize) -> Added {
        let mut whole = Added::default();
        self.all.gains.iter().skip(column).step_by(self.all.n_columns).for_each(|gain| whole.add(gain.net()));
        whole
    }
}

/// A sum that keeps what it rounds away: a run adds to it in every step.
fn add(sum: &mut f64, lost: &mut f64, term: f64) {
    let term = term - *lost;
    let next = *sum + term;
    *lost = (next - *sum) - term;
    *sum = next;
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_comes_and_goes_is_told_apart_by_door_and_column() {
        let mut book = Book::new(3, 2);
        book.enter(1, 2, &[vec![1.0, 2.0], vec![0.5, 0.25]]);
        let mut moved = book.blank();
        moved.leave(2, &[vec![4.0, 8.0], vec![0.0, 1.0]], 1);
        moved.change(2, 0, 0.5);
        moved.change(2, 0, -0.25);
        book.take(&moved);
        assert_eq!(book.gains(1), [Gain { entered: 3.0, left: 0.0 }, Gain { entered: 0.75, left: 0.0 }]);
        assert_eq!(book.gains(2), [Gain { entered: 0.5, left: 8.25 }, Gain { entered: 0.0, left: 1.0 }]);
        assert_eq!((book.parcels(1), book.parcels(2)), ([2, 0], [0, 1]));
        assert_eq!(book.whole(0), Added { sum: -4.75, size: 11.75 });
    }

    #[test]
    fn small_terms_are_not_lost_beside_large_sums() {
        let mut book = Book::new(1, 1);
        book.enter(0, 1, &[vec![1e16]]);
        (0..1000).for_each(|_| book.enter(0, 1, &[vec![0.5]]));
        assert_eq!(book.gains(0)[0].entered, 1e16 + 500.0);
    }
}
