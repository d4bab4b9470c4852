//! Words for the types of Rust that serde names where a text has something else.

/// The type in words, of one that serde says it expected; `None`: its own words are good.
pub fn type_in_words(expected: &str) -> Option<&'static str> {
    Some(match expected {
        "f32" | "f64" => "a number",
        "i8" | "i16" | "i32" | "i64" | "isize" => "a whole number",
        "u8" | "u16" | "u32" | "u64" | "usize" => "a whole number, 0 or more",
        "a sequence" => "a list, as in [1, 2]",
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn types_of_rust_have_words_and_others_keep_theirs() {
        assert_eq!(type_in_words("usize"), Some("a whole number, 0 or more"));
        assert_eq!(type_in_words("i64"), Some("a whole number"));
        assert_eq!(type_in_words("a string"), None);
    }
}
