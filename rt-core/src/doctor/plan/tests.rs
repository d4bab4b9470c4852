//! How the script quotes; what it says for whole machines is tested in `tests/doctor/plan.rs`.

use super::*;

#[test]
fn foreign_text_cannot_leave_its_comment_or_its_quotes() {
    let mut script = Script { text: String::new() };
    script.comment("a\nrm -rf / \u{1b}[2J\u{202e}");
    assert_eq!(script.text, "# a?rm -rf / ?[2J?\n");
    assert_eq!(quoted("/a/b_c-1"), "/a/b_c-1");
    assert_eq!(quoted("it's $HOME; `x`"), "'it'\\''s $HOME; `x`'");
    assert_eq!(quoted(""), "''");
}
