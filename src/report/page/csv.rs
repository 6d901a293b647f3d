//! The numbers of a figure as comma-separated text.
//!
//! Owns quoting. May use nothing. It deliberately writes numbers so that they read back to the same
//! bits.

/// A table with its header.
#[derive(Debug, Clone, PartialEq)]
pub struct Csv {
    pub text: String,
}

impl Csv {
    pub fn new<S: AsRef<str>>(heads: &[S]) -> Self {
        let mut csv = Self { text: String::new() };
        csv.row(heads.iter().map(|head| head.as_ref().to_owned()).collect());
        csv
    }

    pub fn row(&mut self, cells: Vec<String>) {
        let cells: Vec<String> = cells.iter().map(|cell| quoted(cell)).collect();
        self.text += &cells.join(",");
        self.text.push('\n');
    }
}

/// The shortest text that reads back to the same number; nothing for what is absent.
pub fn number(value: Option<f64>) -> String {
    match value {
        Some(value) if value != 0.0 && !(1e-5..1e16).contains(&value.abs()) => format!("{value:e}"),
        Some(value) => format!("{value}"),
        None => String::new(),
    }
}

fn quoted(cell: &str) -> String {
    if cell.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", cell.replace('"', "\"\""))
    } else {
        cell.to_owned()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_keep_their_bits_and_texts_their_commas() {
        for value in [0.1 + 0.2, 1e-300, -5e-324, 1e22, 123_456.789, 0.0] {
            assert_eq!(number(Some(value)).parse::<f64>().unwrap().to_bits(), value.to_bits());
        }
        let mut csv = Csv::new(&["a", "b"]);
        csv.row(vec!["x, \"y\"".to_owned(), number(None)]);
        assert_eq!(csv.text, "a,b\n\"x, \"\"y\"\"\",\n");
    }
}
