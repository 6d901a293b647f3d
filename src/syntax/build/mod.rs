//! Pest's pairs to the tree.
//!
//! Owns the walk over pairs. May use `tree`, `grammar`, `climb`, `units` (symbols only).
//! It deliberately trusts the grammar for order and presence of parts: a part that is not there is
//! answered with a message, never with a panic.

mod data;
mod expressions;
mod kernels;
mod quantity;
mod statements;
mod sweeps;
mod transport;

use super::climb::Built;
use super::grammar::Rule;
use super::tree::{Name, Statement, Text};
use crate::diagnostic::{Diagnostic, codes};
use crate::source::{FileId, Span, Spanned};
use pest::iterators::{Pair, Pairs};

/// Where the text of a statement lies in its file.
#[derive(Clone, Copy)]
pub struct Place {
    pub file: FileId,
    pub offset: usize,
}

/// Builds the statement of a rule's pair.
pub fn statement(place: Place, span: Span, keyword: Span, pair: Pair<Rule>) -> Built<Statement> {
    let rule = pair.as_rule();
    let kind = statements::kind(Parts::of(place, pair), rule)?;
    Ok(Statement { span, keyword, kind })
}

/// The children of a pair that carry content, in order; keywords and punctuation are left out.
struct Parts<'i> {
    place: Place,
    /// The span of the whole pair, for messages.
    whole: Span,
    pairs: std::iter::Peekable<Pairs<'i, Rule>>,
}

impl<'i> Parts<'i> {
    fn of(place: Place, pair: Pair<'i, Rule>) -> Self {
        let whole = span_at(place, &pair);
        let mut parts = Self { place, whole, pairs: pair.into_inner().peekable() };
        parts.skip_punctuation();
        parts
    }

    fn skip_punctuation(&mut self) {
        while self.pairs.next_if(|pair| is_punctuation(pair.as_rule())).is_some() {}
    }

    /// The next part, whatever it is.
    fn next(&mut self) -> Option<Pair<'i, Rule>> {
        let pair = self.pairs.next();
        self.skip_punctuation();
        pair
    }

    /// The next part, if it is of this rule.
    fn take(&mut self, rule: Rule) -> Option<Pair<'i, Rule>> {
        if self.pairs.peek()?.as_rule() == rule { self.next() } else { None }
    }

    /// The next part, which the grammar promises.
    fn need(&mut self, rule: Rule) -> Built<Pair<'i, Rule>> {
        let whole = self.whole;
        self.take(rule)
            .ok_or_else(|| Box::new(Diagnostic::error(codes::S001, "a part is missing here").at(whole, "")))
    }

    fn name(&mut self) -> Built<Name> {
        let pair = self.need(Rule::name)?;
        Ok(spanned(self.place, &pair))
    }

    /// The next part, if it is a name.
    fn take_name(&mut self) -> Built<Option<Name>> {
        let is_name = self.pairs.peek().is_some_and(|pair| pair.as_rule() == Rule::name);
        is_name.then(|| self.name()).transpose()
    }

    /// A rule that holds nothing but a name, such as the kind of an output.
    fn wrapped_name(&mut self, rule: Rule) -> Built<Name> {
        let pair = self.need(rule)?;
        Parts::of(self.place, pair).name()
    }

    fn names(&mut self, rule: Rule) -> Vec<Name> {
        let place = self.place;
        std::iter::from_fn(|| self.take(rule)).map(|pair| spanned(place, &pair)).collect()
    }

    fn text(&mut self) -> Built<Text> {
        let pair = self.need(Rule::text)?;
        unescape(span_at(self.place, &pair), pair.as_str())
    }

    fn optional_text(&mut self) -> Built<Option<Text>> {
        let is_text = self.pairs.peek().is_some_and(|pair| pair.as_rule() == Rule::text);
        is_text.then(|| self.text()).transpose()
    }
}

fn is_punctuation(rule: Rule) -> bool {
    use Rule as R;
    matches!(
        rule,
        R::comma
            | R::colon
            | R::plus
            | R::assign
            | R::box_word
            | R::open_round
            | R::close_round
            | R::open_brace
            | R::close_brace
    ) || matches!(rule, R::dots | R::rate_sign | R::times_sign | R::zone_end | R::entry_end | R::EOI)
        || is_keyword(rule)
}

fn is_keyword(rule: Rule) -> bool {
    use Rule as R;
    let begins = matches!(
        rule,
        R::kw_lamella
            | R::kw_title
            | R::kw_cite
            | R::kw_seed
            | R::kw_let
            | R::kw_param
            | R::kw_fn
            | R::kw_species
    ) || matches!(
        rule,
        R::kw_reaction
            | R::kw_domain
            | R::kw_boundary
            | R::kw_flow
            | R::kw_dispersion
            | R::kw_chemistry
            | R::kw_mixing
            | R::kw_average
    ) || matches!(rule, R::kw_medium | R::kw_source | R::kw_exchange | R::kw_kernel)
        || matches!(
            rule,
            R::kw_initial | R::kw_particles | R::kw_run | R::kw_output | R::kw_reference | R::kw_measure
        )
        || matches!(rule, R::kw_data | R::kw_use | R::kw_sweep | R::kw_report);
    let joins = matches!(
        rule,
        R::kw_zones
            | R::kw_frame
            | R::kw_moving
            | R::kw_support
            | R::kw_to
            | R::kw_step
            | R::kw_t
            | R::kw_in
            | R::kw_at
            | R::kw_every
    ) || matches!(
        rule,
        R::kw_along | R::kw_on | R::kw_over | R::kw_for | R::kw_if | R::kw_then | R::kw_else
    ) || matches!(
        rule,
        R::kw_as | R::kw_of | R::kw_by | R::kw_until | R::kw_when | R::kw_zip | R::kw_skip
    ) || matches!(
        rule,
        R::kw_expect | R::kw_factor | R::kw_against | R::kw_replicates | R::kw_common | R::less
    );
    let of_transport =
        matches!(
            rule,
            R::kw_head | R::kw_flux | R::kw_no_flow | R::kw_periodic | R::kw_conductivity | R::kw_anisotropy
        ) || matches!(rule, R::kw_well | R::kw_rate | R::kw_screen | R::kw_grid | R::kw_during)
            || matches!(rule, R::kw_change | R::kw_carrying);
    begins || joins || of_transport
}

fn span_at(place: Place, pair: &Pair<Rule>) -> Span {
    let span = pair.as_span();
    Span::new(place.file, place.offset + span.start(), place.offset + span.end())
}

fn spanned(place: Place, pair: &Pair<Rule>) -> Spanned<String> {
    Spanned::new(pair.as_str().to_owned(), span_at(place, pair))
}

/// The inside of a quoted text.
fn unescape(span: Span, quoted: &str) -> Built<Text> {
    let inner = quoted.strip_prefix('"').and_then(|rest| rest.strip_suffix('"')).unwrap_or(quoted);
    let mut value = String::with_capacity(inner.len());
    let mut chars = inner.chars();
    while let Some(c) = chars.next() {
        match if c == '\\' { chars.next() } else { Some('\0') } {
            Some('\0') => value.push(c),
            Some(quote @ ('"' | '\\')) => value.push(quote),
            Some('n') => value.push('\n'),
            Some('t') => value.push('\t'),
            other => return Err(unknown_escape(span, other)),
        }
    }
    Ok(Spanned::new(value, span))
}

fn unknown_escape(span: Span, character: Option<char>) -> Box<Diagnostic> {
    let found = character.map(|c| format!("`\\{c}`")).unwrap_or_default();
    let diagnostic = Diagnostic::error(codes::S001, "this text has an escape that is not known")
        .at(span, "in this text")
        .found(found)
        .expected("one of `\\\"`, `\\\\`, `\\n`, `\\t`")
        .help("a backslash itself is written `\\\\`");
    Box::new(diagnostic)
}
