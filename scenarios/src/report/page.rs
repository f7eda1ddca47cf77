//! The page around a report: one self-contained HTML file.

use maud::{DOCTYPE, Markup, PreEscaped, html};

const STYLE: &str = "
:root{color-scheme:light dark;--paper:#fff;--ink:#1b1f24;--soft:#5b6470;--line:#d9dee4;--tint:#f5f7f9;--accent:#1f7ac4;--good:#12805c;--bad:#b3402a}
@media (prefers-color-scheme:dark){:root{--paper:#14171b;--ink:#e6e9ec;--soft:#9aa4af;--line:#30363d;--tint:#1c2127;--accent:#5aa9e6;--good:#3fb68b;--bad:#e0775f}}
*{box-sizing:border-box}
body{margin:0;background:var(--paper);color:var(--ink);font:16px/1.55 system-ui,-apple-system,'Segoe UI',Roboto,'Helvetica Neue',Arial,sans-serif}
main{max-width:1080px;margin:0 auto;padding:2.5rem 1.5rem 4rem}
h1{font-size:1.9rem;line-height:1.2;margin:0 0 .3rem;letter-spacing:-.01em}
h2{font-size:1.25rem;margin:2.6rem 0 .6rem;padding-top:1.1rem;border-top:1px solid var(--line)}
h3{font-size:1rem;margin:1.4rem 0 .4rem}
p{max-width:72ch;margin:.5rem 0}
.lead{color:var(--soft);margin-top:0}
.verdict{border-left:4px solid var(--accent);background:var(--tint);padding:.8rem 1.1rem;margin:1.2rem 0;border-radius:0 6px 6px 0}
.verdict.good{border-color:var(--good)}.verdict.bad{border-color:var(--bad)}
.verdict p{margin:.2rem 0}
.figures{display:grid;grid-template-columns:repeat(auto-fit,minmax(min(100%,440px),1fr));gap:1.2rem;margin:1rem 0}
figure{margin:0}
figcaption{color:var(--soft);font-size:.88rem;margin-top:.2rem;max-width:64ch}
svg{width:100%;height:auto;display:block;font-family:inherit}
svg text{fill:var(--ink);font-family:inherit}
svg [stroke='#000000']{stroke:var(--ink)}
svg [fill='#FFFFFF']{fill:var(--paper)}
.wide{overflow-x:auto}
table{border-collapse:collapse;margin:.8rem 0;font-size:.92rem;font-variant-numeric:tabular-nums}
th,td{padding:.32rem .8rem;border-bottom:1px solid var(--line);text-align:right;white-space:nowrap}
td.wrap{white-space:normal;min-width:16rem;color:var(--soft)}
th{font-weight:600;color:var(--soft);border-bottom:2px solid var(--line)}
th:first-child,td:first-child,.text{text-align:left}
tr.ours td{font-weight:600}
.tag{display:inline-block;padding:0 .5em;border-radius:4px;font-size:.85em;background:var(--tint);border:1px solid var(--line)}
.tag.good{color:var(--good)}.tag.bad{color:var(--bad)}
code,pre{font:.88em/1.45 ui-monospace,SFMono-Regular,Menlo,Consolas,monospace}
pre{background:var(--tint);border:1px solid var(--line);border-radius:6px;padding:1rem;overflow-x:auto}
details summary{cursor:pointer;color:var(--soft)}
footer{margin-top:3rem;color:var(--soft);font-size:.85rem;border-top:1px solid var(--line);padding-top:.8rem}
@media print{body{font-size:11pt}h2{break-after:avoid}figure,table{break-inside:avoid}}
";

/// A whole page.
pub fn page(title: &str, lead: &str, body: &Markup) -> String {
    html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                title { (title) }
                style { (PreEscaped(STYLE)) }
            }
            body {
                main {
                    h1 { (title) }
                    p.lead { (lead) }
                    (body)
                    footer {
                        "Colluvium " (env!("CARGO_PKG_VERSION")) ". SI units throughout; "
                        "pressure is positive in compression; p is a third of the trace of the stress."
                    }
                }
            }
        }
    }
    .into_string()
}

/// A plot with its caption.
pub fn figure(svg: &str, caption: &str) -> Markup {
    html! {
        @if !svg.is_empty() {
            figure { (PreEscaped(svg)) figcaption { (caption) } }
        }
    }
}

/// A number with four significant digits.
pub fn number(value: f64) -> String {
    if !value.is_finite() {
        return "–".to_owned();
    }
    let size = value.abs();
    if value == 0.0 {
        "0".to_owned()
    } else if value.fract() == 0.0 && size < 1e6 {
        format!("{value:.0}")
    } else if !(1e-3..1e6).contains(&size) {
        format!("{value:.3e}")
    } else {
        let digits = (3 - size.log10().floor() as i32).max(0) as usize;
        format!("{value:.digits$}")
    }
}

/// A value and its standard error, both to the digits that the error allows.
pub fn with_error(value: f64, error: f64) -> String {
    if !(error.is_finite() && error > 0.0 && value.is_finite()) {
        return number(value);
    }
    // A value that its error swamps, or that is huge, is no number to be read to the last digit.
    if error.max(value.abs()) >= 1e5 {
        return format!("{} ± {}", number(value), number(error));
    }
    let digits = (1 - error.log10().floor() as i32).clamp(0, 12) as usize;
    format!("{value:.digits$} ± {error:.digits$}")
}

/// A large count with thin spaces between thousands.
pub fn count(value: u64) -> String {
    let digits = value.to_string();
    let mut text = String::new();
    for (n, digit) in digits.chars().enumerate() {
        if n > 0 && (digits.len() - n).is_multiple_of(3) {
            text.push('\u{2009}');
        }
        text.push(digit);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_show_what_they_know() {
        assert_eq!(number(0.0331549), "0.03315");
        assert_eq!(number(1234.56), "1235");
        assert_eq!(with_error(0.50612, 0.0194), "0.506 ± 0.019");
        assert_eq!(with_error(8.2e12, 7.5e18), "8.200e12 ± 7.500e18");
        assert_eq!(count(1234567), "1\u{2009}234\u{2009}567");
    }
}
