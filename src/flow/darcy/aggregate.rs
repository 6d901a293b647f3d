//! Joining nodes for a coarser system.
//!
//! Owns the choice of partners and the system of what is joined. May use the matrix. It deliberately solves
//! nothing.

use super::matrix::Matrix;

/// No group yet.
const FREE: u32 = u32::MAX;

/// Bound of [`quality`]: lower, and groups stay small in three dimensions; higher, and iterations grow.
const WORST: f64 = 12.0;

/// Joins nodes two by two where that harms least, twice.
///
/// - Equation: `A_c = Pᵀ A P`, `P` one where a node is in a group, else zero.
/// - Symbols: groups of up to four nodes.
/// - Range: symmetric M-matrices; strong neighbours are joined first, so that anisotropy and layers are followed.
/// - Source: Y. Notay (2010), Electron. Trans. Numer. Anal. 37, 123.
/// - Shape: group of each node, and the coarse system.
pub fn coarsen(fine: &Matrix) -> (Vec<u32>, Matrix) {
    let (first, pairs) = pair(fine);
    let (second, fours) = pair(&pairs);
    (first.into_iter().map(|group| second[group as usize]).collect(), fours)
}

fn pair(fine: &Matrix) -> (Vec<u32>, Matrix) {
    let mut group = vec![FREE; fine.n()];
    let mut n_groups = 0;
    for i in 0..fine.n() {
        if group[i] != FREE {
            continue;
        }
        group[i] = n_groups;
        let (nodes, conductances) = fine.row(i);
        let mut best = (WORST, FREE);
        for (&node, &conductance) in nodes.iter().zip(conductances) {
            let quality = quality(fine, i, node as usize, conductance);
            if group[node as usize] == FREE && quality < best.0 {
                best = (quality, node);
            }
        }
        if best.1 != FREE {
            group[best.1 as usize] = n_groups;
        }
        n_groups += 1;
    }
    let coarse = join(fine, &group, n_groups as usize);
    (group, coarse)
}

/// How much slower the solution of the fine system becomes if two nodes are one on the coarse.
///
/// - Equation: `μ = 2 H(a_i, a_j) / (t_ij + H(c_i, c_j))`, `H(x, y) = x y/(x + y)`.
/// - Symbols: `t` conductance between the nodes, `a` diagonals, `c` anchors.
/// - Range: symmetric M-matrices; a weak node may join a strong one, if the link is strong to the weak one.
/// - Source: A. Napov and Y. Notay (2012), SIAM J. Sci. Comput. 34, A1079, doi:10.1137/100818509.
/// - Shape: 1 for two nodes without other neighbours.
fn quality(fine: &Matrix, i: usize, j: usize, conductance: f64) -> f64 {
    let half = |x: f64, y: f64| if x + y > 0.0 { x * y / (x + y) } else { 0.0 };
    2.0 * half(fine.diagonal[i], fine.diagonal[j]) / (conductance + half(fine.anchor[i], fine.anchor[j]))
}

/// The system of the groups: conductances between two groups add up, those inside one vanish.
fn join(fine: &Matrix, group: &[u32], n_groups: usize) -> Matrix {
    let mut members = vec![[FREE; 2]; n_groups];
    for (i, &group) in group.iter().enumerate() {
        let slot = &mut members[group as usize];
        slot[usize::from(slot[0] != FREE)] = i as u32;
    }
    let mut coarse = Matrix { start: vec![0], anchor: vec![0.0; n_groups], ..Matrix::default() };
    // Where the conductance to a group stands in the row that is being written.
    let mut place = vec![FREE; n_groups];
    for (own, members) in members.iter().enumerate() {
        let row_start = coarse.node.len();
        for &member in members.iter().filter(|&&member| member != FREE) {
            coarse.anchor[own] += fine.anchor[member as usize];
            let (nodes, conductances) = fine.row(member as usize);
            for (&node, &conductance) in nodes.iter().zip(conductances) {
                let other = group[node as usize] as usize;
                let at = place[other] as usize;
                if other == own {
                    continue;
                }
                if place[other] != FREE && at >= row_start {
                    coarse.conductance[at] += conductance;
                } else {
                    place[other] = coarse.node.len() as u32;
                    coarse.node.push(other as u32);
                    coarse.conductance.push(conductance);
                }
            }
        }
        coarse.start.push(coarse.node.len() as u32);
    }
    coarse.close();
    coarse
}
