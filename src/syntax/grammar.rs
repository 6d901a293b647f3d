//! The grammar as a parser: one statement's text to pest's pairs.
//!
//! Owns the derived parser and the rule of each keyword. May use `grammar/lamella.pest` only.
//! It deliberately is the only place that names the grammar file.

use pest_derive::Parser;

#[derive(Parser)]
#[grammar = "../grammar/lamella.pest"]
pub struct Grammar;

/// The rule of the statement that begins with `keyword`.
pub fn rule_of(keyword: &str) -> Option<Rule> {
    Some(match keyword {
        "lamella" => Rule::edition,
        "title" => Rule::title,
        "cite" => Rule::cite,
        "seed" => Rule::seed,
        "let" => Rule::constant,
        "param" => Rule::parameter,
        "fn" => Rule::function,
        "species" => Rule::species,
        "reaction" => Rule::reaction,
        "chemistry" => Rule::chemistry,
        "domain" => Rule::domain,
        "boundary" => Rule::boundary,
        "medium" => Rule::medium,
        "flow" => Rule::flow,
        "dispersion" => Rule::dispersion,
        "source" => Rule::source,
        "mixing" => Rule::mixing,
        "exchange" => Rule::exchange,
        "kernel" => Rule::kernel,
        "average" => Rule::average,
        "initial" => Rule::initial,
        "particles" => Rule::particles,
        "run" => Rule::run,
        "output" => Rule::output,
        "reference" => Rule::reference,
        "measure" => Rule::measure,
        "data" => Rule::data,
        "use" => Rule::r#use,
        "sweep" => Rule::sweep,
        "report" => Rule::report,
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::syntax::words::STATEMENT_KEYWORDS;

    #[test]
    fn every_keyword_has_a_rule() {
        assert!(STATEMENT_KEYWORDS.iter().all(|keyword| rule_of(keyword).is_some()));
    }
}
