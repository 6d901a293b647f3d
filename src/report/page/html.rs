//! Pieces of the page: text that is safe, tables, figures, and the frame around them.
//!
//! Owns the look of the page. May use nothing. It deliberately asks no other server or file for
//! anything and runs no script: the page is one file that can be mailed, printed and kept.

/// Text as it may stand in a page. Characters that HTML does not know are shown as a mark.
pub fn escape(text: &str) -> String {
    let mut safe = String::with_capacity(text.len());
    for letter in text.chars() {
        match letter {
            '&' => safe.push_str("&amp;"),
            '<' => safe.push_str("&lt;"),
            '>' => safe.push_str("&gt;"),
            '"' => safe.push_str("&quot;"),
            '\'' => safe.push_str("&#39;"),
            '\n' | '\t' => safe.push(letter),
            control if control.is_control() => safe.push('\u{fffd}'),
            other => safe.push(other),
        }
    }
    safe
}

pub fn paragraph(text: &str) -> String {
    format!("<p>{}</p>\n", escape(text))
}

/// A figure with the sentence under it, which also stands for it where it cannot be seen.
pub fn figure(svg: &str, caption: &str) -> String {
    let caption = escape(caption);
    let drawn = svg.replacen("<svg ", &format!("<svg role=\"img\" aria-label=\"{caption}\" "), 1);
    format!("<figure>{drawn}<figcaption>{caption}</figcaption></figure>\n")
}

/// Cells that are numbers stand to the right.
pub fn table(heads: &[&str], rows: &[Vec<String>]) -> String {
    let is_number =
        |text: &str| text.chars().next().is_some_and(|c| c.is_ascii_digit() || "−±-–".contains(c));
    let mut out = String::from("<div class=\"wide\"><table><thead><tr>");
    heads.iter().for_each(|head| out += &format!("<th>{}</th>", escape(head)));
    out += "</tr></thead><tbody>\n";
    for row in rows {
        out += "<tr>";
        for cell in row {
            let class = if is_number(cell) { " class=\"n\"" } else { "" };
            out += &format!("<td{class}>{}</td>", escape(cell));
        }
        out += "</tr>\n";
    }
    out + "</tbody></table></div>\n"
}

/// A long text as it is, in a box that scrolls and is whole in print; cut where it would make the page heavy.
pub fn verbatim(text: &str, most: usize) -> String {
    let end = text.char_indices().map(|(idx, _)| idx).find(|idx| *idx >= most).unwrap_or(text.len());
    let rest = if end < text.len() { "\n… (cut here; the file has the rest)" } else { "" };
    format!("<pre>{}{rest}</pre>\n", escape(&text[..end]))
}

/// A heading with what stands under it.
pub struct Section {
    pub id: &'static str,
    pub heading: String,
    pub body: String,
}

pub fn page(title: &str, summary: &str, sections: &[Section]) -> String {
    let mut out = format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<title>{0}</title>\n\
         <style>{STYLE}</style>\n</head>\n<body>\n<main>\n<h1>{0}</h1>\n{summary}<nav>",
        escape(title)
    );
    for section in sections {
        out += &format!("<a href=\"#{}\">{}</a> ", section.id, escape(&section.heading));
    }
    out += "</nav>\n";
    for section in sections {
        let Section { id, heading, body } = section;
        out += &format!("<section id=\"{id}\">\n<h2>{}</h2>\n{body}</section>\n", escape(heading));
    }
    out + "</main>\n</body>\n</html>\n"
}

const STYLE: &str = "\
:root{color-scheme:light}\
body{margin:0;background:#fff;color:#1a1a1a;font:16px/1.5 system-ui,sans-serif}\
main{max-width:1100px;margin:0 auto;padding:1.5rem}\
h1{font-size:1.7rem;margin:0 0 .5rem}\
h2{font-size:1.25rem;margin:2rem 0 .5rem;border-bottom:1px solid #bbb}\
h3{font-size:1.05rem;margin:1.2rem 0 .3rem}\
.lead{font-size:1.05rem;max-width:60rem}\
nav a{margin-right:1rem}\
a{color:#0b57a4}\
figure{margin:1rem 0;break-inside:avoid}\
figure svg{max-width:100%;height:auto}\
figcaption{font-size:.9rem;color:#333;max-width:60rem}\
.wide{overflow-x:auto}\
table{border-collapse:collapse;font-size:.9rem;margin:.5rem 0}\
th,td{padding:.2rem .6rem;border-bottom:1px solid #ddd;text-align:left;vertical-align:top}\
td.n{text-align:right;font-variant-numeric:tabular-nums;white-space:nowrap}\
pre{background:#f6f6f6;padding:.7rem;overflow:auto;max-height:24rem;font-size:.85rem;white-space:pre-wrap}\
@media print{nav{display:none}main{max-width:none;padding:0}pre{max-height:none}h2{break-after:avoid}}";

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_text_of_a_scene_becomes_part_of_the_page() {
        let hostile = "<script>alert('x')</script> & \"y\"\u{1b}[2J\u{0}";
        let safe = escape(hostile);
        assert!(!safe.contains(['<', '>', '"', '\'', '\u{1b}', '\u{0}']), "{safe}");
        let whole = page(hostile, &paragraph(hostile), &[]);
        assert!(!whole.contains("<script") && !whole.contains('\u{1b}'));
        assert!(verbatim("aé<b", 2).contains("<pre>aé\n…"), "{}", verbatim("aé<b", 2));
    }
}
