//! Water through planes and sides.
//!
//! Owns these sums. May use `flow`, media and the plan. It deliberately looks at no particle.

use super::super::track::medium::Medium;
use super::world::Site;
use crate::flow::FaceFlow;
use crate::plan::Station;

/// Points along each other axis at which a flow that is not on cells is looked at.
const POINTS: usize = 64;

impl<const D: usize> Site<'_, D> {
    /// Water through a station in the direction that counts during a flow, m³/s (m², m with fewer axes).
    pub fn water<M: Medium<D>>(&self, medium: &M, station: &Station, period: usize) -> f64 {
        match station {
            Station::Part { of, low, high } => {
                let array = |list: &[f64]| std::array::from_fn(|axis| list[axis]);
                self.water_within(medium, of, [array(low), array(high)], period)
            }
            Station::Well(name) => self.taken_out(name, period),
            Station::Plane { .. } | Station::Side(_) => {
                self.water_within(medium, station, [self.low, self.high], period)
            }
            Station::Box { .. } => f64::NAN,
        }
    }

    /// Water that a well takes out of all its cells.
    fn taken_out(&self, name: &str, period: usize) -> f64 {
        let (Some((_, outlet)), Some(flow)) = (self.plan.outlet(name), self.face_flow(period)) else {
            return f64::NAN;
        };
        let own = flow.sinks.iter().filter(|sink| sink.owner == outlet.owner && sink.rate > 0.0);
        own.map(|sink| sink.rate).sum()
    }

    fn water_within<M: Medium<D>>(
        &self,
        medium: &M,
        station: &Station,
        within @ [low, high]: [[f64; D]; 2],
        period: usize,
    ) -> f64 {
        let (axis, at, sign) = match *station {
            Station::Plane { axis, at } => (axis, at, 1.0),
            Station::Side(side) if side % 2 == 0 => (side / 2, self.low[side / 2], -1.0),
            Station::Side(side) => (side / 2, self.high[side / 2], 1.0),
            _ => return f64::NAN,
        };
        let Some(flow) = self.face_flow(period) else {
            return sign * self.by_points(medium, axis, at, within);
        };
        let mut limits = [[f64::NEG_INFINITY; 3], [f64::INFINITY; 3]];
        for (axis, of) in self.plan.axes.iter().enumerate() {
            (limits[0][of.index], limits[1][of.index]) = (low[axis], high[axis]);
        }
        sign * through(flow, self.plan.axes[axis].index, at, limits)
    }

    /// The midpoint rule over a plane between limits.
    fn by_points<M: Medium<D>>(&self, medium: &M, axis: usize, at: f64, [low, high]: [[f64; D]; 2]) -> f64 {
        let others: Vec<usize> = (0..D).filter(|&other| other != axis).collect();
        let area: f64 = others.iter().map(|&other| high[other] - low[other]).product();
        let n = POINTS.pow(others.len() as u32);
        let places: Vec<[f64; D]> = (0..n)
            .map(|mut idx| {
                let mut place = low;
                place[axis] = at;
                for &other in &others {
                    let part = ((idx % POINTS) as f64 + 0.5) / POINTS as f64;
                    place[other] += part * (high[other] - low[other]);
                    idx /= POINTS;
                }
                place
            })
            .collect();
        let porosity = self.evaluate(&self.transport.porosity, &places, 0.0);
        let sum: f64 = places
            .iter()
            .zip(porosity)
            .map(|(&place, porosity)| porosity * medium.velocity(place, axis))
            .sum();
        sum / n as f64 * area
    }
}

/// Discharge through a plane normal to an axis of the scene, between limits along the others: linear between the
/// faces on either side, as velocities in cells are.
fn through(flow: &FaceFlow, axis: usize, at: f64, [from, to]: [[f64; 3]; 2]) -> f64 {
    let edges = &flow.cells.edges()[axis];
    let n = flow.cells.n();
    let cell = edges.partition_point(|&edge| edge <= at).clamp(1, n[axis]) - 1;
    let part = ((at - edges[cell]) / (edges[cell + 1] - edges[cell])).clamp(0.0, 1.0);
    let mut sums = [0.0; 2];
    let mut place = [0; 3];
    place[axis] = cell;
    let [a, b] = [0, 1, 2].iter().copied().filter(|&other| other != axis).collect::<Vec<_>>()[..] else {
        return f64::NAN;
    };
    for i in 0..n[a] {
        for j in 0..n[b] {
            (place[a], place[b]) = (i, j);
            let (low, high) = flow.cells.faces(axis, place);
            let within = |axis: usize| {
                let edges = &flow.cells.edges()[axis][place[axis]..place[axis] + 2];
                let shared = edges[1].min(to[axis]) - edges[0].max(from[axis]);
                (shared / (edges[1] - edges[0])).clamp(0.0, 1.0)
            };
            let area = flow.cells.face_area(axis, place) * within(a) * within(b);
            sums[0] += area * flow.flux[axis][low];
            sums[1] += area * flow.flux[axis][high];
        }
    }
    sums[0] + part * (sums[1] - sums[0])
}
