//! Separators of a table in text: hints for one that a spreadsheet of another language wrote.
//!
//! Problem: where numbers have a decimal comma, spreadsheets separate columns by semicolons, and what is copied out of
//! them by tabs. A reader that expects commas sees one long column, or twice as many cells, and complains of those.
//! Model: nothing is guessed and read; the hint says what was probably found and what is needed.

/// Words for a text whose lines end in carriage returns alone.
pub fn mistaken_ends(text: &str) -> Option<&'static str> {
    let is_of_returns = text.trim_end_matches('\r').contains('\r') && !text.contains('\n');
    is_of_returns.then_some(
        "its lines end in carriage returns alone, as of old Macintoshes; save it with the line ends of Unix or Windows",
    )
}

/// What to say of a first line whose columns are not separated by commas.
pub fn hint_for_header(line: &str) -> &'static str {
    let count = |separator: char| line.matches(separator).count();
    let (commas, semicolons, tabs) = (count(','), count(';'), count('\t'));
    if semicolons > commas && semicolons >= tabs {
        "; it has semicolons, and columns are separated by commas: save it as CSV with commas, and decimal points"
    } else if tabs > commas {
        "; it has tabs, and columns are separated by commas: save it as CSV with commas"
    } else {
        ""
    }
}

/// What to say of a row that has more cells than the header has columns.
pub fn hint_for_row(line: &str, columns: usize) -> &'static str {
    let cells = line.split(',').count();
    let is_whole = |cell: &str| cell.trim().trim_start_matches(['+', '-']).parse::<u64>().is_ok();
    let whole = line.split(',').filter(|cell| is_whole(cell)).count();
    // A row of decimal commas has no more than twice the cells, and no points; one cell more is only one too many.
    if (columns + 2..=2 * columns).contains(&cells) && !line.contains('.') && 2 * whole > cells {
        "; if its numbers have decimal commas, write points, as in 0.1"
    } else {
        ""
    }
}

/// A cell without the quotes that some programs, R's `write.csv` among them, put around it. One of text that has commas or
/// quotes itself is none of ours, and stays as it is.
pub fn unquoted(cell: &str) -> &str {
    let trimmed = cell.trim();
    let inner = trimmed.strip_prefix('"').and_then(|rest| rest.strip_suffix('"'));
    inner.filter(|inner| !inner.contains('"')).unwrap_or(cell)
}

/// A line without quotes around its cells.
pub fn unquoted_line(line: String) -> String {
    if !line.contains('"') {
        return line;
    }
    let cells: Vec<&str> = line.split(',').map(unquoted).collect();
    cells.join(",")
}

/// What to say of a cell that is no number.
pub fn hint_for_cell(cell: &str) -> &'static str {
    let is_comma = |point: char| point == ',';
    let number = cell.replacen(is_comma, ".", 1);
    if cell.contains(is_comma) && number.parse::<f64>().is_ok() { DECIMAL_POINT } else { "" }
}

/// Hint for a cell that is half of one in quotes.
pub fn hint_for_half_a_cell(cell: &str) -> &'static str {
    let number = cell.strip_prefix('"').or_else(|| cell.strip_suffix('"'));
    if number.is_some_and(|number| number.parse::<f64>().is_ok()) { DECIMAL_POINT } else { "" }
}

const DECIMAL_POINT: &str = "; a decimal number has a point, as in 0.1";

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_between_semicolons_and_tabs_are_told_and_those_between_commas_are_not() {
        assert!(hint_for_header("t;f0_x;f0_y").contains("it has semicolons"));
        assert!(hint_for_header("sep=;").contains("it has semicolons"));
        assert!(hint_for_header("t\tf0_x\tf0_y").contains("it has tabs"));
        for good in ["t,f0_x,f0_y", "t, \tx", "", "time", "a;b,c,d"] {
            assert_eq!(hint_for_header(good), "", "{good:?}");
        }
    }

    #[test]
    fn lines_that_end_in_carriage_returns_alone_are_told_and_those_of_windows_are_not() {
        assert!(mistaken_ends("t,x\r0,1\r").is_some_and(|words| words.contains("carriage returns")));
        for good in ["", "t,x\r\n0,1\r\n", "t,x\n", "t", "t\r"] {
            assert_eq!(mistaken_ends(good), None, "{good:?}");
        }
    }

    #[test]
    fn quotes_around_a_cell_are_no_part_of_it() {
        for (line, cells) in [
            ("\"t\",\"f0_x\", \"f 1\" ", "t,f0_x,f 1"),
            ("1,\"0.5\",\"\"", "1,0.5,"),
            ("\"a,b\",c", "\"a,b\",c"),
            ("\"say \"\"a\"\"\",\",x", "\"say \"\"a\"\"\",\",x"),
        ] {
            assert_eq!(unquoted_line(line.into()), cells);
        }
    }

    #[test]
    fn rows_of_decimal_commas_are_told_and_rows_that_are_only_longer_are_not() {
        for comma in ["0,5,0,01,-1,25,0,0", "1,0,5,2,25,3"] {
            assert!(hint_for_row(comma, 4).contains("write points"), "{comma:?}");
        }
        for other in ["0.5,1,2,3,4,5", "1,2,3,4,5", "1,2,3,4", "1,2,3", "a,b,c,d,e,f", "1,2,3,4,5,6,7,8,9"] {
            assert_eq!(hint_for_row(other, 4), "", "{other:?}");
        }
    }

    #[test]
    fn a_number_with_a_decimal_comma_is_told_and_other_words_are_not() {
        for comma in ["0,5", "-12,25", "1,5e-3"] {
            assert!(hint_for_cell(comma).contains("a point"), "{comma:?}");
        }
        for other in ["", ",", "0.5", "a,b", "1,2,3", "x"] {
            assert_eq!(hint_for_cell(other), "", "{other:?}");
        }
        // Of `"0,05"`, which is one cell elsewhere.
        assert!(
            hint_for_half_a_cell("\"0").contains("a point")
                && hint_for_half_a_cell("05\"").contains("a point")
        );
        for other in ["", "\"", "0", "\"a", "a"] {
            assert_eq!(hint_for_half_a_cell(other), "", "{other:?}");
        }
    }
}
