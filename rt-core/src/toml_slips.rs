//! Usual slips in a TOML text, by the place at which the parser stops.
//!
//! Problem: a parser complains of what it wanted next. Of `name = table` it says that it wanted `true`, of a path with
//! backslashes that digits are missing; who wrote that looks for digits.
//! Model: the characters around the place are looked at; where they are those of a usual slip, the words say what to
//! write instead. Else the parser's own words stand.

/// What to say of an error at a byte of a text; `said`: the parser's words.
pub fn explain(text: &str, offset: usize, said: &str) -> String {
    let said = said.lines().collect::<Vec<_>>().join("; ");
    let (Some(before), Some(rest)) = (text.get(..offset), text.get(offset..)) else { return said };
    let before = before.rsplit('\n').next().unwrap_or_default();
    let rest = rest.split(['\n', '\r']).next().unwrap_or_default();
    nothing(before, rest)
        .map(str::to_owned)
        .or_else(|| foreign_comment(before, rest).map(str::to_owned))
        .or_else(|| word_without_quotes(before, rest))
        .or_else(|| number_with_unit(before, rest))
        .or_else(|| typographic_minus(before, rest))
        .or_else(|| expression(before, rest))
        .or_else(|| half_a_number(before, rest).map(str::to_owned))
        .or_else(|| backslash(before, &said).map(str::to_owned))
        .or_else(|| typographic_quotes(before, rest, &said).map(str::to_owned))
        .unwrap_or_else(|| said.clone() + in_numbers(before, rest))
}

/// What to say of `[key]` where a list of tables belongs: found, and allowed.
pub fn single_table(key: &str) -> [String; 2] {
    [
        format!("a single table, as `[{key}]` makes it"),
        format!("{}: write it with two brackets, even if there is only one", tables(key)),
    ]
}

/// What a list of tables is.
pub fn tables(key: &str) -> String {
    format!("a list of tables, each under its own [[{key}]]")
}

/// `radius_m =`
fn nothing(before: &str, rest: &str) -> Option<&'static str> {
    let is_nothing =
        before.trim_end().ends_with('=') && rest.split('#').next().is_some_and(|rest| rest.trim().is_empty());
    is_nothing.then_some("found nothing behind =; allowed: a value")
}

/// `; words`, `// words`, and `name: table`
fn foreign_comment(before: &str, rest: &str) -> Option<&'static str> {
    let line = [before, rest].concat();
    let line = line.trim_start();
    if line.starts_with(';') || line.starts_with("//") {
        return Some("a comment begins with #");
    }
    let (key, _) = line.split_once(':')?;
    let is_key = !key.is_empty() && key.chars().all(|c| c.is_ascii_alphanumeric() || c == '_' || c == '-');
    is_key.then_some("between a key and its value stands =, as in name = \"table\"")
}

/// `name = table`
fn word_without_quotes(before: &str, rest: &str) -> Option<String> {
    const MOST_CHARS: usize = 40;
    // Not the name of a table: `[motor]`.
    let is_value = before.contains('=') && before.trim_end().ends_with(['=', '[', ',']);
    let is_in_word = |c: char| c.is_alphanumeric() || matches!(c, '_' | '-' | '.' | '/');
    let word: String = rest.chars().take_while(|&c| is_in_word(c)).take(MOST_CHARS).collect();
    if !is_value || !word.starts_with(|c: char| c.is_alphabetic() || c == '/') {
        return None;
    }
    let small = word.to_lowercase();
    Some(match small.as_str() {
        "true" | "false" => format!("found {word}, allowed: {small}, in small letters"),
        "yes" | "on" | "no" | "off" => {
            format!("found {word}, allowed: true or false; text stands in quotes")
        }
        _ => format!("found {word} without quotes; text stands in quotes, as in \"{word}\""),
    })
}

/// `5 mm`, `500N/m`
fn number_with_unit(before: &str, rest: &str) -> Option<String> {
    const MOST_CHARS: usize = 40;
    let value = value_around(before, rest).filter(|_| before.contains('='))?;
    let is_one = value.chars().count() <= MOST_CHARS && has_unit(&value);
    is_one.then(|| format!("found {value}, allowed: a number alone; {NO_UNITS}"))
}

/// Value in which the parser stopped, from its beginning to its end.
fn value_around(before: &str, rest: &str) -> Option<String> {
    let (_, begun) = before.rsplit_once(['=', '[', ','])?;
    let ends = [',', ']', '}', '#'];
    Some([begun, rest.split(ends).next().unwrap_or_default()].concat().trim().to_owned())
}

/// A minus as word processors and journals write it.
fn typographic_minus(before: &str, rest: &str) -> Option<String> {
    let value = value_around(before, rest)?;
    let number = value.strip_prefix(['\u{2212}', '\u{2010}', '\u{2011}', '\u{2013}', '\u{2014}'])?;
    is_number(number).then(|| format!("found {value}, whose minus is a typographic one; allowed: -{number}"))
}

/// `1/3`, `2 * 0.05`
fn expression(before: &str, rest: &str) -> Option<String> {
    let value = value_around(before, rest)?;
    let (left, right) = value.split_once(['/', '*'])?;
    let both = is_number(left.trim()) && is_number(right.trim());
    both.then(|| format!("found {value}, allowed: a number that is worked out, as in 0.333"))
}

/// Words for a text in quotes where a number is expected.
pub fn hint_for_text(text: &str) -> String {
    if has_unit(text.trim()) {
        format!("; {NO_UNITS}")
    } else if text.trim().parse::<f64>().is_ok_and(f64::is_finite) {
        "; a number stands without quotes".into()
    } else {
        String::new()
    }
}

const NO_UNITS: &str = "numbers have no units, the name of the key tells the unit";

/// A number, and behind it letters that begin a unit.
fn has_unit(text: &str) -> bool {
    let is_unit = |unit: &str| {
        let unit = unit.trim_start();
        unit.starts_with(|c: char| c.is_alphabetic() || matches!(c, '%' | '°' | 'µ'))
            && unit.chars().all(|c| c.is_alphanumeric() || " %°µ/*^².-·".contains(c))
    };
    // The longest beginning that is a number: `5e` has none of the exponent.
    let ends = text.char_indices().map(|(at, _)| at).skip(1).take(40);
    let number = ends.filter(|&at| is_number(&text[..at])).last();
    number.is_some_and(|end| is_unit(&text[end..]) && !is_of_another_base(text))
}

fn is_number(text: &str) -> bool {
    text.ends_with(|c: char| c.is_ascii_digit() || c == '.') && text.replace('_', "").parse::<f64>().is_ok()
}

/// `0xff`, `0b1`
fn is_of_another_base(text: &str) -> bool {
    ["0x", "0o", "0b"].iter().any(|begin| text.starts_with(begin))
}

/// `.05`, `5.`
fn half_a_number(before: &str, rest: &str) -> Option<&'static str> {
    let unsigned = rest.strip_prefix(['+', '-']).unwrap_or(rest);
    let begins_with_digit = |text: &str| text.starts_with(|c: char| c.is_ascii_digit());
    let ends_in_digit = |text: &str| text.ends_with(|c: char| c.is_ascii_digit());
    if unsigned.strip_prefix('.').is_some_and(begins_with_digit) {
        Some("a number has a digit before its point, as in 0.05")
    } else if before.strip_suffix('.').is_some_and(ends_in_digit) {
        Some("a number has a digit behind its point, as in 5.0")
    } else {
        None
    }
}

/// `"C:\Users"`
fn backslash(before: &str, said: &str) -> Option<&'static str> {
    (before.contains('\\') && (said.contains("unicode") || said.contains("escape"))).then_some(
        "between \" a backslash begins a special character; in a path write / for it, or put the path between '",
    )
}

/// What word processors make of quotes.
fn typographic_quotes(before: &str, rest: &str, said: &str) -> Option<&'static str> {
    let is_typographic = |c: char| matches!(c, '\u{2018}'..='\u{201f}' | '\u{ab}' | '\u{bb}');
    (said.contains("string") && (before.contains(is_typographic) || rest.contains(is_typographic)))
        .then_some("found typographic quotes; text stands between straight ones, as in \"table\"")
}

/// `0,5` and `[1 2]`, in which the parser sees the end of a value.
fn in_numbers(before: &str, rest: &str) -> &'static str {
    let ends_in_digit = |text: &str| text.ends_with(|c: char| c.is_ascii_digit());
    let begins_with_digit = |text: &str| text.starts_with(|c: char| c.is_ascii_digit());
    let mut numbers = rest.split_whitespace().map(|word| word.trim_end_matches([',', ']', '}']));
    let is_number = |word: Option<&str>| word.is_some_and(|word| word.parse::<f64>().is_ok());
    // `0,1`, seen at the comma or behind the second number.
    let behind = before.trim_end().trim_end_matches(|c: char| c.is_ascii_digit()).strip_suffix(',');
    let at_comma = ends_in_digit(before) && rest.strip_prefix(',').is_some_and(begins_with_digit);
    if at_comma || ends_in_digit(before.trim_end()) && behind.is_some_and(ends_in_digit) {
        "; a decimal number has a point, as in 0.1"
    } else if is_number(numbers.next()) && is_number(numbers.next()) {
        "; between two numbers of an array stands a comma, as in [0.0, 1.0]"
    } else {
        ""
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(text: &str, part: &str, said: &str) -> String {
        explain(text, text.find(part).expect("a part of it"), said)
    }

    #[test]
    fn a_word_without_quotes_is_told_with_its_quotes() {
        let boolean = "invalid boolean, expected `true`";
        assert!(at("a = 1\nname = table\n", "table", boolean).ends_with("as in \"table\""));
        assert!(at("x = /run/x", "/run", boolean).ends_with("as in \"/run/x\""));
        assert!(at("x = [1, two]", "two", boolean).contains("found two without quotes"));
        assert_eq!(at("movable = True", "True", boolean), "found True, allowed: true, in small letters");
        assert!(at("movable = no # not yet", "no", boolean).contains("found no, allowed: true or false"));
        assert_eq!(at("[motor]", "motor", boolean), boolean);
        for other in ["x = = 1", "x = 1"] {
            assert_eq!(explain(other, 4, boolean), boolean, "{other}");
        }
    }

    #[test]
    fn a_number_with_its_unit_is_told_that_the_key_has_it() {
        let string = "string values must be quoted, expected literal string";
        for (text, found) in [
            ("r = 5 mm\n", "5 mm"),
            ("r = 5mm # thick", "5mm"),
            ("r = -1.5e-3 m/s", "-1.5e-3 m/s"),
            ("r = 5 %", "5 %"),
            ("x = [0.1 m, 2]", "0.1 m"),
            ("shape = { kind = 'sphere', r = 5 mm }", "5 mm"),
        ] {
            let said = at(text, found, string);
            assert!(said.starts_with(&format!("found {found}, allowed: a number alone; ")), "{said}");
            assert!(said.ends_with("the name of the key tells the unit"), "{said}");
        }
        for (text, part) in [("r = 1 2", "1 2"), ("r = 0xzz", "0xzz"), ("r = 5", "5"), ("[5 mm]", "5 mm")] {
            assert!(!at(text, part, string).contains("unit"), "{text}");
        }
        for text in ["500 N/m", "5mm", " 1 kHz "] {
            assert!(hint_for_text(text).ends_with("tells the unit"), "{text}");
        }
        assert_eq!(hint_for_text("500"), "; a number stands without quotes");
        for text in ["", "two", "N 5", "nan", "2024-01-01", "1 2", "5 apples and a pear!"] {
            assert_eq!(hint_for_text(text), "", "{text}");
        }
    }

    #[test]
    fn numbers_as_they_are_printed_and_sums_are_told_with_what_to_write() {
        let string = "string values must be quoted, expected literal string";
        for (value, number) in [("\u{2212}0.5", "0.5"), ("\u{2013}1e3", "1e3")] {
            let said = at(&format!("x = {value} # left"), value, string);
            assert!(said.ends_with(&format!("typographic one; allowed: -{number}")), "{said}");
        }
        for (text, place, found) in
            [("x = 1/3", 5, "1/3"), ("x = [1, 2 * 0.5]", 10, "2 * 0.5"), ("x = {y = 1/2}", 10, "1/2")]
        {
            let said = explain(text, place, "unexpected key or value");
            assert!(
                said.starts_with(&format!("found {found}, allowed: a number that is worked out")),
                "{said}"
            );
        }
        for other in ["x = 1/a", "x = ./3", "x = \u{2212}", "x = \u{2212}y", "1/3"] {
            assert_eq!(explain(other, other.len(), string), string, "{other}");
        }
    }

    #[test]
    fn nothing_comments_and_colons_of_other_languages_are_told_with_what_to_write() {
        let string = "string values must be quoted, expected literal string";
        for text in ["x = ", "x =", "x =   # later"] {
            assert_eq!(explain(text, 3.min(text.len()), string), "found nothing behind =; allowed: a value");
        }
        let key = "key with no value, expected `=`";
        for text in ["; my scene", "// my scene", "  // x = 1"] {
            assert_eq!(explain(text, text.len(), key), "a comment begins with #", "{text}");
        }
        assert!(explain("name: \"table\"", 4, key).ends_with("as in name = \"table\""));
        for text in ["x = 12:30", "a b", "x = [1, 2] ; y"] {
            assert_eq!(explain(text, text.len(), key), key, "{text}");
        }
    }

    #[test]
    fn half_numbers_paths_and_typographic_quotes_are_told_with_what_to_write() {
        let number = "invalid mantissa, expected digits";
        assert!(at("r = .05", ".05", number).ends_with("as in 0.05"));
        assert!(at("r = [-.05, 1]", "-.05", number).ends_with("as in 0.05"));
        assert!(explain("r = 5.\n", 6, number).ends_with("as in 5.0"));
        let path = "x = \"C:\\Users\\me\"";
        let said = at(path, "sers", "too few unicode value digits, expected unicode hexadecimal value");
        assert!(said.contains("write /") && !said.contains("digits"), "{said}");
        let string = "string values must be quoted, expected literal string";
        for quotes in ["x = \u{201c}a\u{201d}", "x = \u{2018}a", "x = \u{ab}a\u{bb}"] {
            assert!(explain(quotes, 4, string).contains("straight"), "{quotes}");
        }
        assert_eq!(
            explain("x = 1 2 # it\u{2019}s", 4, "unexpected key"),
            "unexpected key; between two numbers of an \
                   array stands a comma, as in [0.0, 1.0]"
        );
    }

    #[test]
    fn places_outside_of_the_text_or_within_a_character_leave_the_parsers_words() {
        for offset in [1, 99] {
            assert_eq!(explain("ä", offset, "wrong\nhere"), "wrong; here");
        }
    }
}
