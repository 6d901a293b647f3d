//! The table in docs/references.md, held against the list; `make bless` writes it.

use super::{ALL, Argument, ArgumentDimension, Item, Predicts};
use crate::units::Dimension;
use std::fmt::Write as _;

const PAGE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/docs/references.md");
const START: &str = "<!-- from here on written by `make bless` -->\n";

#[test]
fn page_shows_every_item_as_it_is() {
    let page = std::fs::read_to_string(PAGE).expect("docs/references.md");
    let (head, shown) = page.split_once(START).expect("the page has a mark where the items start");
    let items: String = ALL.iter().map(section).collect();
    if shown == items {
        return;
    }
    if std::env::var_os("LAMELLA_BLESS").is_some() {
        std::fs::write(PAGE, format!("{head}{START}{items}")).expect("docs/references.md can be written");
    } else {
        panic!("docs/references.md differs from the catalogue; look at the change and run `make bless`");
    }
}

fn section(item: &Item) -> String {
    let mut text = format!(
        "\n### {}\n\n{}. For {}.\n\n`{}`\n\n| argument | unit | default | what it is |\n|---|---|---|---|\n",
        item.name,
        upper_first(item.summary),
        outputs(item.predicts),
        item.equation,
    );
    for argument in item.arguments {
        let default = argument.default.map_or("required".to_owned(), |value| value.to_string());
        let (name, unit, doc) = (argument.name, unit(argument), argument.doc.replace('|', "\\|"));
        writeln!(text, "| `{name}` | {unit} | {default} | {doc} |").expect("text grows");
    }
    writeln!(text, "\nSource: {}.", item.source.trim_end_matches('.')).expect("text grows");
    text
}

fn upper_first(text: &str) -> String {
    let mut characters = text.chars();
    characters.next().map_or(String::new(), |first| first.to_uppercase().chain(characters).collect())
}

fn outputs(predicts: Predicts) -> &'static str {
    match predicts {
        Predicts::Concentration => "`profile` and `map` of a species",
        Predicts::Covariance => "`covariance` of a pair",
        Predicts::Gamma => "`mixing` of a pair",
        Predicts::Total => "`total` of a species",
        Predicts::Moment => "`xx`, `yy` or `zz` of the `moments` of a species",
    }
}

fn unit(argument: &Argument) -> &'static str {
    match argument.dimension {
        ArgumentDimension::Concentration => "mol/m³ or kg/m³",
        ArgumentDimension::ConcentrationPerTime => "mol/m³/s or kg/m³/s",
        ArgumentDimension::Fixed(Dimension::NONE) => "–",
        ArgumentDimension::Fixed(Dimension::LENGTH) => "m",
        ArgumentDimension::Fixed(Dimension::RATE) => "1/s",
        ArgumentDimension::Fixed(Dimension::VELOCITY) => "m/s",
        ArgumentDimension::Fixed(Dimension::DISPERSION) => "m²/s",
        ArgumentDimension::Fixed(other) => panic!("give {other:?} a unit on this page"),
    }
}
