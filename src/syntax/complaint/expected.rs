//! Rules and tokens in the user's words.
//!
//! Owns what each rule of the grammar is called in a message. May use `grammar`.
//! It deliberately shows no rule's own name.

use crate::syntax::grammar::Rule;

/// What any expression is called.
pub const VALUE: &str = "a value";
/// What follows the last token of a statement.
pub const END: &str = "the end of the statement";

/// A token in backticks, shortened where it is long; a text in quotes as it is.
pub fn quoted(token: &str) -> String {
    format!("`{}`", shortened(token))
}

pub fn shortened(token: &str) -> String {
    const MAX_SHOWN: usize = 40;
    let mut shown: String = token.chars().take(MAX_SHOWN).collect();
    if shown.len() < token.len() {
        shown.push('…');
    }
    shown
}

pub fn join_words(words: &[String]) -> String {
    match words {
        [] => "something else".to_owned(),
        [one] => one.clone(),
        [first @ .., last] => format!("{} or {last}", first.join(", ")),
    }
}

/// The word of a keyword's rule.
pub fn literal(rule: Rule) -> Option<&'static str> {
    use Rule as R;
    Some(match rule {
        R::kw_zones => "zones",
        R::kw_frame | R::frame => "frame",
        R::kw_moving => "moving",
        R::kw_support | R::support => "support",
        R::kw_disorder => "disorder",
        R::kw_to => "to",
        R::kw_step | R::run_step => "step",
        R::kw_in | R::in_unit | R::in_box => "in",
        R::kw_at | R::at | R::at_place => "at",
        R::kw_every | R::every => "every",
        R::kw_along | R::along => "along",
        R::kw_on | R::on => "on",
        R::kw_over | R::over => "over",
        R::kw_for => "for",
        R::kw_then => "then",
        R::kw_else => "else",
        R::kw_as => "as",
        R::kw_of => "of",
        R::kw_by | R::series => "by",
        R::kw_until | R::criterion => "until",
        R::kw_when => "when",
        R::kw_factor => "factor",
        R::kw_against => "against",
        R::kw_head => "head",
        R::kw_flux => "flux",
        R::kw_no_flow => "no_flow",
        R::kw_periodic => "periodic",
        R::kw_conductivity => "conductivity",
        R::kw_anisotropy => "anisotropy",
        R::kw_well => "well",
        R::kw_rate | R::well_rate => "rate",
        R::kw_screen | R::screen => "screen",
        R::kw_grid => "grid",
        R::kw_during | R::during => "during",
        R::kw_change | R::change => "change",
        R::kw_carrying | R::well_carrying => "carrying",
        R::change_times => "at",
        _ => return None,
    })
}

/// What a rule is called in messages; nothing for what would only confuse.
pub fn expected_words(rule: Rule) -> Vec<String> {
    use Rule as R;
    let one = |word: &str| vec![word.to_owned()];
    if is_of_darcy(rule) {
        return one("an entry such as `head left 1 m`");
    }
    match rule {
        R::EOI => one(END),
        R::expression | R::prefix | R::number | R::conditional | R::call | R::path | R::tuple => one(VALUE),
        R::range => one("a range `low .. high`"),
        R::infix => one("an operator"),
        R::name | R::dotted | R::term | R::species_item | R::species_list | R::assignment | R::target => {
            one("a name")
        }
        R::reactants | R::products | R::target_kind | R::share => one("a name"),
        R::kind | R::output_kind | R::shape | R::boundary_kind => one("a kind"),
        R::setting | R::chemistry_setting | R::exchange_setting | R::average_part => one("a setting"),
        R::estimate => one("a kernel such as `gaussian adaptive`"),
        R::estimate_entry => one("an entry such as `grid 0.5 m`"),
        R::rate | R::signed_number | R::corner | R::region_argument | R::sweep_value | R::progression => {
            one(VALUE)
        }
        R::argument | R::argument_name => one("an argument"),
        R::label | R::zone => one("a name with `:`"),
        R::zone_field => one("a field such as `rate`"),
        R::averaging => vec!["`resident`".into(), "`flux_weighted`".into()],
        R::box_word => one("`box`"),
        R::qualifier | R::placement | R::charge_word | R::ion_size_word => one("a further word"),
        R::coefficient => one("a number"),
        R::text => one("a text in quotes"),
        R::bare_number | R::count | R::counts | R::grid_counts => one("a number"),
        R::unit => one("a unit"),
        R::axis_name | R::axis | R::patch => ["`x`", "`y`", "`z`"].map(str::to_owned).to_vec(),
        R::side => one("a side such as `left`"),
        R::arrow => one("`->`"),
        R::rate_sign => one("`@`"),
        R::dots => one("`..`"),
        R::side_value => one("a side such as `left`"),
        R::darcy => one("`{`"),
        R::file_unit => one("a unit in brackets, such as `[m]`"),
        R::files => one("a file name in quotes"),
        R::file_entry | R::entry_word => one("an entry such as `length [m]`"),
        R::file_column => one("a column"),
        R::entry_end => one("`;`"),
        R::dispersion_part | R::dispersion_word => one("a part such as `longitudinal 0.5 m`"),
        R::medium_part => one("a property such as `porosity 0.3`"),
        R::carried => one("a name with `=`"),
        R::data_rule | R::side_rate | R::valued | R::valued_word => one("a further word"),
        R::region => one("a region such as `at point(1 m, 2 m)`"),
        R::column => one("a column such as `t [s]`"),
        R::column_unit => one("a unit in brackets such as `[mg/L]`"),
        R::times_sign => one("`x`"),
        R::replicates | R::sweep_seed | R::common | R::skip | R::expect | R::zip => Vec::new(),
        R::sweep_axis => one("an axis such as `step 1 s, 2 s`"),
        R::less => one("`<`"),
        R::zone_end | R::comma => one("`,`"),
        R::colon => one("`:`"),
        R::plus => one("`+`"),
        R::assign => one("`=`"),
        R::open_round => one("`(`"),
        R::close_round => one("`)`"),
        R::open_brace => one("`{`"),
        R::close_brace => one("`}`"),
        R::kw_t => one("`t`"),
        _ => literal(rule).map(|word| format!("`{word}`")).into_iter().collect(),
    }
}

fn is_of_darcy(rule: Rule) -> bool {
    use Rule as R;
    matches!(
        rule,
        R::head | R::flux | R::no_flow | R::periodic | R::conductivity | R::anisotropy | R::well | R::cells
    )
}
