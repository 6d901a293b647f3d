//! Texts that nobody would write, made from a number: the same number gives the same text.

use lamella::syntax::{RESERVED_WORDS, STATEMENT_KEYWORDS};
use lamella::units::known_symbols;
use std::ops::Range;

/// SplitMix64: small, and the same everywhere.
pub struct Random(pub u64);

impl Random {
    pub fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// A number below `n`, which is not 0.
    pub fn below(&mut self, n: usize) -> usize {
        (self.next() % n as u64) as usize
    }

    pub fn pick<'a, T>(&mut self, list: &'a [T]) -> &'a T {
        &list[self.below(list.len())]
    }

    pub fn word<'a, S: AsRef<str>>(&mut self, list: &'a [S]) -> &'a str {
        self.pick(list).as_ref()
    }
}

/// Makes texts out of the pieces of some scenes.
pub struct Noise {
    scenes: Vec<String>,
    /// Words, numbers and symbols of the language and of the scenes.
    pieces: Vec<String>,
    units: Vec<String>,
    lines: Vec<String>,
}

const SYMBOLS: &[&str] = &[
    "<->", "->", "<=", ">=", "==", "!=", "..", "(", ")", "{", "}", "[", "]", ",", "=", "+", "-", "*", "/",
    "^", "<", ">", "@", ":", ";", ".", "·", "%", "‰", "\"", "#", "\n", "\r\n", "\\", "−", "²", "°",
    "\u{feff}", "𝛘",
];
const NUMBERS: &[&str] = &[
    "0",
    "1",
    "-1",
    "0.5",
    "1e308",
    "1e-308",
    "1e-400",
    "9e999",
    "1e2147483648",
    "1e-99999999999999999999",
    "18446744073709551616",
    "18446744073709551615",
    "4294967296",
    "1_000_000_000",
    "0.1e-17",
    "1.",
    ".5",
    "999999999999999999999999999999999999999999999999999999999999999999999999",
];
const CALLS: &[&str] = &[
    "exp",
    "ln",
    "log10",
    "sqrt",
    "abs",
    "min",
    "max",
    "tanh",
    "erf",
    "erfc",
    "sin",
    "cos",
    "pow",
    "f",
    "g",
    "h",
    "front_limit",
    "step_front",
    "l2",
    "integral",
];

impl Noise {
    pub fn new(scenes: impl IntoIterator<Item = String>) -> Self {
        let scenes: Vec<String> = scenes.into_iter().collect();
        let words =
            STATEMENT_KEYWORDS.iter().chain(RESERVED_WORDS).chain(SYMBOLS).chain(NUMBERS).chain(CALLS);
        let mut pieces: Vec<String> = words.map(|word| (*word).to_owned()).collect();
        let mut lines = Vec::new();
        for text in &scenes {
            pieces.extend(pieces_of(text).into_iter().map(|range| text[range].to_owned()));
            lines.extend(text.lines().map(str::to_owned));
        }
        Self { scenes, pieces, units: known_symbols().collect(), lines }
    }

    /// The text of a number.
    pub fn text(&self, number: u64) -> String {
        let random = &mut Random(number.wrapping_mul(0xd134_2543_de82_ef95));
        match random.below(17) {
            0 => bytes(random),
            1 => characters(random),
            2 => self.soup(random),
            3 => format!("lamella 1\n{}", self.statements(random)),
            4 => self.shuffled(random),
            5 => self.with_functions(random),
            6 => self.with_depth(random),
            7 => self.with_units(random),
            8 => self.with_numbers(random),
            9 => of_extremes(random),
            _ => self.damaged(random),
        }
    }

    fn scene(&self, random: &mut Random) -> &str {
        random.word(&self.scenes)
    }

    fn soup(&self, random: &mut Random) -> String {
        let glue = *random.pick(&["", " ", " ", "\n"]);
        let n_pieces = random.below(400);
        (0..n_pieces).map(|_| random.word(&self.pieces)).collect::<Vec<_>>().join(glue)
    }

    /// Lines that begin as statements do and go on anyhow.
    fn statements(&self, random: &mut Random) -> String {
        let mut text = String::new();
        for _ in 0..random.below(40) {
            text += random.word(STATEMENT_KEYWORDS);
            for _ in 0..random.below(12) {
                text.push(' ');
                text += random.word(&self.pieces);
            }
            text.push('\n');
        }
        text
    }

    /// Lines of several scenes mixed.
    fn shuffled(&self, random: &mut Random) -> String {
        let mut text = "lamella 1\n".to_owned();
        for _ in 0..random.below(80) {
            text += random.word(&self.lines);
            text.push('\n');
        }
        text
    }

    /// Functions that call each other, with arguments that grow.
    fn with_functions(&self, random: &mut Random) -> String {
        let mut text = self.scene(random).to_owned();
        let n_functions = 1 + random.below(60);
        for idx in 0..n_functions {
            let called = if random.below(8) == 0 { random.below(n_functions) } else { idx.saturating_sub(1) };
            let body =
                *random.pick(&["F(a) * F(a)", "F(F(a))", "F(a, a)", "F(a) + a", "if a < 1 then F(a) else a"]);
            let body = if idx == 0 { "a + a".to_owned() } else { body.replace('F', &format!("f{called}")) };
            text += &format!("fn f{idx}(a) = {body}\n");
        }
        text + &format!("let deep = f{}({})\n", n_functions - 1, random.word(&self.pieces))
    }

    /// Brackets, signs, conditionals and powers inside each other.
    fn with_depth(&self, random: &mut Random) -> String {
        let (open, close) = *random.pick(&[
            ("(", ")"),
            ("(", ""),
            ("-", ""),
            ("if 1 < 2 then ", " else 3"),
            ("if 1 < 2 then ", ""),
            ("not ", ""),
            ("2 ^ ", ""),
            ("1 + ", ""),
            ("exp(", ")"),
            ("min(1, ", ")"),
            ("{ ", "}"),
            ("1 - (", ")"),
        ]);
        let depth = *random.pick(&[1, 10, 60, 70, 250, 260, 3000]);
        let value = format!("{}1{}", open.repeat(depth), close.repeat(depth));
        format!("{}let deep = {value}\ninitial A = {value}\n", self.scene(random))
    }

    fn with_units(&self, random: &mut Random) -> String {
        let mut unit = random.word(&["", "/"]).to_owned();
        for _ in 0..random.below(40) {
            unit += random.word(&self.units);
            unit += random.word(&["", "^2", "^-9", "^9", "^99999999999", "^0", "²", "^"]);
            unit += random.word(&["/", "·", ".", "*", " ", "//"]);
        }
        unit += random.word(&self.units);
        let scene = self.scene(random).replacen(*random.pick(&["cm", "s", "mol/L", "/s"]), &unit, 2);
        format!("{scene}let odd = {} {unit}\n", random.word(NUMBERS))
    }

    /// A scene with some of its numbers replaced by extreme ones.
    fn with_numbers(&self, random: &mut Random) -> String {
        let mut text = self.scene(random).to_owned();
        for _ in 0..1 + random.below(4) {
            let places = pieces_of(&text);
            let is_number =
                |range: &Range<usize>| text[range.clone()].starts_with(|c: char| c.is_ascii_digit());
            let numbers: Vec<_> = places.into_iter().filter(is_number).skip(1).collect();
            if !numbers.is_empty() {
                text.replace_range(random.pick(&numbers).clone(), random.word(NUMBERS));
            }
        }
        text
    }

    /// A scene with several tokens replaced, doubled, left out or broken.
    fn damaged(&self, random: &mut Random) -> String {
        let mut text = self.scene(random).to_owned();
        for _ in 0..1 + random.below(6) {
            let places = pieces_of(&text);
            if places.is_empty() {
                return text;
            }
            let range = random.pick(&places).clone();
            match random.below(5) {
                0 => text.replace_range(range, ""),
                1 => text.replace_range(range, random.word(&self.pieces)),
                2 => text.insert_str(range.start, random.word(&self.pieces)),
                3 => {
                    let again = text[range.clone()].to_owned();
                    text.insert_str(range.end, &again);
                }
                _ => {
                    let start = floor_boundary(&text, random.below(text.len()));
                    let end = floor_boundary(&text, (start + random.below(30)).min(text.len()));
                    text.replace_range(start..end.max(start), "");
                }
            }
        }
        text
    }
}

/// Numbers that can be written, with sums, products, squares and quotients that cannot.
const EXTREMES: &[&str] = &[
    "0", "1", "-1", "2", "10", "0.3", "5e-324", "1e-323", "1e-310", "2.3e-308", "1e-300", "1e-160", "1e-155",
    "1e-110", "1e-30", "1e30", "1e110", "1e155", "1e200", "1e300", "1e307", "1.7e308", "-1.7e308", "-1e-160",
    "-1e155",
];

/// A sound scene, but for the size of its numbers: it reaches the plan and its limits.
fn of_extremes(random: &mut Random) -> String {
    let mut number = |often: &str| {
        if random.below(3) == 0 { random.word(EXTREMES).to_owned() } else { often.to_owned() }
    };
    let mut axis = |name: &str| format!("{name} = {} m .. {} m", number("0"), number("7"));
    let axes = [axis("x"), axis("y"), axis("z")];
    let (flow, spread) = ([number("1"), number("0"), number("-2")], [number("0"), number("1"), number("3")]);
    let numbers: Vec<String> = ["0.1", "2", "100", "6", "2", "5", "1"].into_iter().map(&mut number).collect();
    let n_axes = 1 + random.below(3);
    let shape = ["line", "rect", "box"][n_axes - 1];
    let sides = [
        &["left, right"][..],
        &["left, right", "bottom, top"],
        &["left, right", "front, back", "bottom, top"],
    ];
    let list = |values: &[String], unit: &str| {
        let parts: Vec<String> = values[..n_axes].iter().map(|value| format!("{value} {unit}")).collect();
        format!("({})", parts.join(", "))
    };
    let mut text = format!("lamella 1\nspecies A, B\ndomain {shape} {}", axes[..n_axes].join(", "));
    if random.below(3) == 0 {
        text += &format!(", frame moving {}", list(&flow, "m/s"));
    }
    for pair in sides[n_axes - 1] {
        text += &format!("\nboundary {pair} {}", random.word(&["open", "reflect", "periodic"]));
    }
    let bins = ["4", "4 x 3", "4 x 3 x 2"][n_axes - 1];
    text + &format!("\nflow uniform {}\ndispersion {}\n", list(&flow, "m/s"), list(&spread, "m^2/s"))
        + &format!(
            "average bins {bins}\nmixing zones {{ a: fraction 0.5, rate instant; b: fraction 0.5, rate {} /s }}\n",
            numbers[0]
        )
        + &format!("initial A = {} mol/m^3 * exp(-x/({} m))\n", numbers[1], numbers[4])
        + &format!(
            "particles fluid {} stratified\nrun to {} s, step {} s\n",
            numbers[2], numbers[3], numbers[6]
        )
        + &format!("output profile A at t = {} s on 3\noutput total A every {} s\n", numbers[3], numbers[6])
        + &format!(
            "measure m = l2(profile.A) over x = {} m .. {} m at t = {} s\n",
            numbers[0], numbers[5], numbers[3]
        )
}

fn bytes(random: &mut Random) -> String {
    let bytes: Vec<u8> = (0..random.below(600)).map(|_| random.next() as u8).collect();
    String::from_utf8_lossy(&bytes).into_owned()
}

fn characters(random: &mut Random) -> String {
    let n_characters = random.below(300);
    let limit = *random.pick(&[0x80, 0x250, 0x3000, 0x11_0000]);
    (0..n_characters).filter_map(|_| char::from_u32(random.below(limit) as u32)).collect()
}

fn floor_boundary(text: &str, mut at: usize) -> usize {
    while !text.is_char_boundary(at) {
        at -= 1;
    }
    at
}

/// Runs of letters and digits, and single other characters: close to tokens, and cheap.
fn pieces_of(text: &str) -> Vec<Range<usize>> {
    let mut pieces: Vec<Range<usize>> = Vec::new();
    let mut was_word = false;
    for (at, c) in text.char_indices() {
        let is_word = c.is_alphanumeric() || c == '_';
        match pieces.last_mut() {
            Some(last) if is_word && was_word => last.end = at + c.len_utf8(),
            _ if c.is_whitespace() => {}
            _ => pieces.push(at..at + c.len_utf8()),
        }
        was_word = is_word;
    }
    pieces
}
