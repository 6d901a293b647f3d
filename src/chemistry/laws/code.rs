//! A graph as straight-line code over lanes of particles.
//!
//! Owns the order of operations, the registers and their evaluation. May use the graph and `maths`. It
//! deliberately has no branch per particle: an operation is decoded once per lane.

use super::graph::{Graph, Id, Node, apply_binary, apply_unary};
use crate::data::{Beyond, Lookup, Table};
use crate::maths::operator::{Binary, Unary};
use std::sync::Arc;

/// Particles that are evaluated together: enough that decoding an operation costs little, few enough
/// that the registers of a usual network stay in the first-level cache.
pub const LANES: usize = 16;

/// One number for each of these particles.
pub type Lane = [f64; LANES];

#[derive(Debug, Clone, Copy, PartialEq)]
enum Opcode {
    Unary(Unary),
    Binary(Binary),
    Select,
    /// `a b + c`, rounded twice.
    MultiplyAdd,
    /// `c − a b`, rounded twice.
    SubtractProduct,
    /// One of the tables.
    Table(u16, Lookup),
}

#[derive(Debug, Clone, Copy)]
struct Instruction {
    opcode: Opcode,
    target: u16,
    operands: [u16; 3],
}

/// Registers `0..n_inputs` are the inputs; then the constants stand, then what is computed.
#[derive(Debug, Clone)]
pub struct Code {
    instructions: Vec<Instruction>,
    constants: Vec<(u16, f64)>,
    tables: Vec<Arc<Table>>,
    n_registers: usize,
    /// The register of each result.
    pub outputs: Vec<u16>,
}

impl Code {
    /// What the results need and nothing else; registers are used again when nobody reads them any more.
    pub fn new(graph: &Graph, n_inputs: usize, roots: &[Id]) -> Result<Self, String> {
        let is_reached = graph.reached(roots);
        let mut writer = Writer::new(graph, &is_reached, roots, n_inputs);
        for id in (0..graph.len() as Id).filter(|&id| is_reached[id as usize]) {
            writer.write(id);
        }
        if writer.n_registers > usize::from(u16::MAX) {
            return Err(format!("the rate laws need {} registers at once, too many", writer.n_registers));
        }
        let outputs = roots.iter().map(|&root| writer.place[root as usize] as u16).collect();
        Ok(Self {
            instructions: writer.instructions,
            constants: writer.constants,
            tables: graph.tables.clone(),
            n_registers: writer.n_registers,
            outputs,
        })
    }

    /// Operations per evaluation.
    pub fn len(&self) -> usize {
        self.instructions.len()
    }

    pub fn is_empty(&self) -> bool {
        self.instructions.is_empty()
    }

    /// Registers with the constants in place.
    pub fn registers(&self) -> Vec<Lane> {
        let mut registers = vec![[0.0; LANES]; self.n_registers];
        self.constants
            .iter()
            .for_each(|&(register, value)| registers[usize::from(register)] = [value; LANES]);
        registers
    }

    /// Evaluates all results. The inputs stand in the first registers.
    #[inline(always)]
    pub fn run(&self, registers: &mut [Lane]) {
        for instruction in &self.instructions {
            match instruction.opcode {
                Opcode::Table(table, lookup) => {
                    look(&self.tables[usize::from(table)], lookup, instruction, registers);
                }
                _ => step(instruction, registers),
            }
        }
    }
}

/// A table at the coordinates of each lane.
fn look(table: &Table, lookup: Lookup, instruction: &Instruction, registers: &mut [Lane]) {
    let at = instruction.operands.map(|operand| registers[usize::from(operand)]);
    let out = &mut registers[usize::from(instruction.target)];
    for (l, value) in out.iter_mut().enumerate() {
        *value = table.look(lookup, at.map(|register| register[l]), Beyond::Hold);
    }
}

/// One loop per operation, so that the choice is made once per lane.
#[inline(always)]
fn step(instruction: &Instruction, registers: &mut [Lane]) {
    let [a, b, c] = instruction.operands;
    let target = usize::from(instruction.target);
    macro_rules! unary {
        ($($name:ident),*) => {
            match instruction.opcode {
                $(Opcode::Unary(Unary::$name) => {
                    let a = registers[usize::from(a)];
                    let out = &mut registers[target];
                    for l in 0..LANES {
                        out[l] = apply_unary(Unary::$name, a[l]);
                    }
                    return;
                })*
                _ => {}
            }
        };
    }
    macro_rules! binary {
        ($($name:ident),*) => {
            match instruction.opcode {
                $(Opcode::Binary(Binary::$name) => {
                    let (a, b) = (registers[usize::from(a)], registers[usize::from(b)]);
                    let out = &mut registers[target];
                    for l in 0..LANES {
                        out[l] = apply_binary(Binary::$name, a[l], b[l]);
                    }
                    return;
                })*
                _ => {}
            }
        };
    }
    macro_rules! ternary {
        ($($name:ident => $value:expr),*) => {
            match instruction.opcode {
                $(Opcode::$name => {
                    let (a, b, c) =
                        (registers[usize::from(a)], registers[usize::from(b)], registers[usize::from(c)]);
                    let out = &mut registers[target];
                    for l in 0..LANES {
                        out[l] = $value(a[l], b[l], c[l]);
                    }
                    return;
                })*
                _ => {}
            }
        };
    }
    binary!(Multiply, Add, Subtract, Divide);
    ternary!(MultiplyAdd => multiply_add, SubtractProduct => subtract_product, Select => select);
    unary!(Negate, Exp, Ln, Sqrt, Abs, Not, Log10, Sin, Cos, Tanh, Erf, Erfc);
    binary!(Maximum, Minimum, Power, Less, LessEqual, Greater, GreaterEqual, Equal, NotEqual, And, Or);
}

#[inline(always)]
fn multiply_add(a: f64, b: f64, c: f64) -> f64 {
    a * b + c
}

#[inline(always)]
fn subtract_product(a: f64, b: f64, c: f64) -> f64 {
    c - a * b
}

#[inline(always)]
fn select(condition: f64, then: f64, otherwise: f64) -> f64 {
    if condition != 0.0 { then } else { otherwise }
}

/// Writes code from nodes in order.
struct Writer<'a> {
    graph: &'a Graph,
    /// How many readers of a node are still to come; results are read for ever.
    readers: Vec<u32>,
    /// Products that are computed where they are added.
    is_fused: Vec<bool>,
    /// Per sum that computes one: the product and the other operand.
    fusions: Vec<Option<(Id, Id)>>,
    place: Vec<u32>,
    free: Vec<u16>,
    n_registers: usize,
    constants: Vec<(u16, f64)>,
    instructions: Vec<Instruction>,
}

impl<'a> Writer<'a> {
    fn new(graph: &'a Graph, is_reached: &[bool], roots: &[Id], n_inputs: usize) -> Self {
        let n = graph.len();
        let mut readers = vec![0; n];
        for id in (0..n as Id).filter(|&id| is_reached[id as usize]) {
            graph.operands(id).for_each(|operand| readers[operand as usize] += 1);
        }
        roots.iter().for_each(|&root| readers[root as usize] += 1 << 24);
        // Now, as readers are counted down while code is written.
        let (mut is_fused, mut fusions) = (vec![false; n], vec![None; n]);
        for id in (0..n as Id).filter(|&id| is_reached[id as usize]) {
            fusions[id as usize] = fusion(graph, &readers, id);
            if let Some((product, _)) = fusions[id as usize] {
                is_fused[product as usize] = true;
            }
        }
        Self {
            graph,
            readers,
            is_fused,
            fusions,
            place: vec![u32::MAX; n],
            free: Vec::new(),
            n_registers: n_inputs,
            constants: Vec::new(),
            instructions: Vec::new(),
        }
    }

    fn new_register(&mut self) -> u32 {
        self.n_registers += 1;
        (self.n_registers - 1) as u32
    }

    fn write(&mut self, id: Id) {
        let at = id as usize;
        match self.graph.node(id) {
            Node::Input(input) => self.place[at] = u32::from(input),
            Node::Constant(bits) => {
                let register = self.new_register();
                self.place[at] = register;
                self.constants.push((register as u16, f64::from_bits(bits)));
            }
            _ if self.is_fused[at] => {}
            Node::Unary(unary, a) => self.emit(id, Opcode::Unary(unary), &[a]),
            Node::Select(a, b, c) => self.emit(id, Opcode::Select, &[a, b, c]),
            Node::Table(table, lookup, at) => self.emit(id, Opcode::Table(table, lookup), &at),
            Node::Binary(binary, a, b) => match self.fusions[at] {
                Some((product, other)) => {
                    let Node::Binary(_, left, right) = self.graph.node(product) else { return };
                    let opcode =
                        if binary == Binary::Add { Opcode::MultiplyAdd } else { Opcode::SubtractProduct };
                    self.emit(id, opcode, &[left, right, other]);
                }
                None => self.emit(id, Opcode::Binary(binary), &[a, b]),
            },
        }
    }

    fn emit(&mut self, id: Id, opcode: Opcode, reads: &[Id]) {
        let mut operands = [0; 3];
        for (operand, &read) in operands.iter_mut().zip(reads) {
            *operand = self.place[read as usize] as u16;
        }
        for &read in reads {
            let readers = &mut self.readers[read as usize];
            *readers -= 1;
            let is_computed = !matches!(self.graph.node(read), Node::Constant(_) | Node::Input(_));
            if *readers == 0 && is_computed {
                self.free.push(self.place[read as usize] as u16);
            }
        }
        let target = match self.free.pop() {
            Some(register) => register,
            None => self.new_register() as u16,
        };
        self.place[id as usize] = u32::from(target);
        self.instructions.push(Instruction { opcode, target, operands });
    }
}

/// A product that only this sum or difference reads, and the other operand.
fn fusion(graph: &Graph, readers: &[u32], id: Id) -> Option<(Id, Id)> {
    let Node::Binary(binary, a, b) = graph.node(id) else { return None };
    let is_lone_product =
        |id: Id| readers[id as usize] == 1 && matches!(graph.node(id), Node::Binary(Binary::Multiply, _, _));
    match binary {
        Binary::Add if is_lone_product(b) => Some((b, a)),
        Binary::Add if is_lone_product(a) => Some((a, b)),
        Binary::Subtract if is_lone_product(b) => Some((b, a)),
        _ => None,
    }
}
