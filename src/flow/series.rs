//! Flows one after another.
//!
//! Owns the order of steady flows in time. May use flows. It deliberately interpolates nothing: each flow holds
//! until the next one begins.

use super::FaceFlow;
use std::fmt;
use std::sync::Arc;

/// One steady flow and when it begins.
#[derive(Debug, Clone, PartialEq)]
pub struct Period {
    /// s since the start of the run
    pub from: f64,
    pub flow: Arc<FaceFlow>,
}

/// Steady flows in the same cells, one after another; the last one lasts for ever. A copy shares them.
#[derive(Debug, Clone, PartialEq)]
pub struct FlowSeries {
    periods: Arc<[Period]>,
}

/// Why flows do not follow one another.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum SeriesError {
    Empty,
    /// The first one begins at this time, s.
    Start(f64),
    /// This one does not begin after the one before it.
    Order(usize),
    /// This one has other cells or another porosity than the first.
    Cells(usize),
}

impl fmt::Display for SeriesError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Empty => write!(f, "there is no flow"),
            Self::Start(from) => write!(f, "the first flow begins at {from} s, not at 0 s"),
            Self::Order(idx) => write!(f, "flow {} does not begin after the one before it", idx + 1),
            Self::Cells(idx) => {
                write!(f, "flow {} has other cells or another porosity than the first", idx + 1)
            }
        }
    }
}

impl std::error::Error for SeriesError {}

impl FlowSeries {
    /// One flow for ever.
    pub fn steady(flow: Arc<FaceFlow>) -> Self {
        Self { periods: Arc::from([Period { from: 0.0, flow }]) }
    }

    /// Flows in rising order of their times, the first at 0 s.
    pub fn new(periods: Vec<Period>) -> Result<Self, SeriesError> {
        let first = periods.first().ok_or(SeriesError::Empty)?;
        if first.from != 0.0 {
            return Err(SeriesError::Start(first.from));
        }
        for (idx, pair) in periods.windows(2).enumerate() {
            if !(pair[1].from > pair[0].from && pair[1].from.is_finite()) {
                return Err(SeriesError::Order(idx + 1));
            }
            let is_same =
                pair[1].flow.cells == first.flow.cells && pair[1].flow.porosity == first.flow.porosity;
            if !is_same {
                return Err(SeriesError::Cells(idx + 1));
            }
        }
        Ok(Self { periods: periods.into() })
    }

    pub fn periods(&self) -> &[Period] {
        &self.periods
    }

    /// The flow of a period; the last one after all of them.
    pub fn flow(&self, period: usize) -> &Arc<FaceFlow> {
        &self.periods[period.min(self.periods.len() - 1)].flow
    }

    /// Times at which a new flow begins during a run, s.
    pub fn changes(&self) -> Vec<f64> {
        self.periods[1..].iter().map(|period| period.from).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flow::Cells;

    fn flow(porosity: f64) -> Arc<FaceFlow> {
        let cells = Cells::equal([0.0; 3], [1.0; 3], [2, 1, 1]).unwrap();
        Arc::new(FaceFlow {
            cells,
            flux: [vec![1.0; 3], vec![0.0; 4], vec![0.0; 4]],
            porosity: vec![porosity; 2],
            head: None,
            conductivity: None,
            sinks: Vec::new(),
        })
    }

    #[test]
    fn flows_follow_one_another() {
        let period = |from, porosity| Period { from, flow: flow(porosity) };
        let series = FlowSeries::new(vec![period(0.0, 0.3), period(10.0, 0.3)]).unwrap();
        assert_eq!(series.changes(), [10.0]);
        assert!(Arc::ptr_eq(series.flow(7), &series.periods()[1].flow));
        assert_eq!(FlowSeries::new(vec![]), Err(SeriesError::Empty));
        assert_eq!(FlowSeries::new(vec![period(1.0, 0.3)]), Err(SeriesError::Start(1.0)));
        for from in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            let list = vec![period(0.0, 0.3), period(from, 0.3)];
            assert_eq!(FlowSeries::new(list), Err(SeriesError::Order(1)), "{from}");
        }
        let list = vec![period(0.0, 0.3), period(1.0, 0.4)];
        assert_eq!(FlowSeries::new(list), Err(SeriesError::Cells(1)));
    }
}
