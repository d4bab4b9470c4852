//! Files that fix plans make: lines are added to them, and no other file is touched.
//!
//! Model: the script's function `add` writes each line that is not there yet to the end of a file. Files of this kind
//! therefore have their growing section last. A file that does not begin with the plan's mark was made by somebody
//! else and is left alone, whatever its name.

use super::super::machine::{Machine, one_line};
use super::{Script, quoted};

/// The script's function. The file's name is its argument, the lines are its input.
pub(super) const ADD: &str = r##"# Adds lines to a file of fix plans, each once. One that somebody else made is left alone.
mark='# made by the fix plan of io-driver doctor'
add() {
    if [ -e "$1" ] && [ "$(head -n 1 "$1")" != "$mark" ]; then
        echo "left alone, no fix plan made it: $1" >&2
        cat >/dev/null
        return 0
    fi
    mkdir -p "${1%/*}"
    [ -e "$1" ] || echo "$mark" >"$1"
    while IFS= read -r line; do
        grep -qxF -e "$line" "$1" || printf '%s\n' "$line" >>"$1"
    done
}
"##;

impl Script {
    /// Adds lines to a file of ours.
    pub(super) fn file(&mut self, path: &str, lines: &[String]) {
        self.line(&format!("add {} <<'END'", quoted(path)));
        lines.iter().for_each(|line| self.line(&one_line(line, 4000)));
        self.line("END");
    }

    /// The same without what another file of that directory says; whether any line was left.
    ///
    /// For files whose lines mean the same in whatever file of the directory they stand.
    pub(super) fn lines_of_directory(
        &mut self,
        machine: &Machine<'_>,
        path: &str,
        lines: &[String],
        what: &str,
    ) -> bool {
        let mut wanted = Vec::new();
        for line in lines {
            match said_by(machine, path, line) {
                Some(file) => self.comment(&format!("{file} says so already: {line}")),
                None => wanted.push(line.clone()),
            }
        }
        if wanted.is_empty() {
            return false;
        }
        self.explain(what, &format!("rm {path}"));
        self.file(path, &wanted);
        true
    }
}

/// The file beside `path` that has this line, in other spacing perhaps.
fn said_by(machine: &Machine<'_>, path: &str, line: &str) -> Option<String> {
    let (directory, _) = path.rsplit_once('/')?;
    let files = machine.names(directory).unwrap_or_default();
    let files = files.into_iter().map(|name| format!("{directory}/{name}")).filter(|file| file != path);
    let says = |file: &String| {
        let text = machine.text(file).unwrap_or_default();
        text.lines().any(|found| words(found) == words(line))
    };
    files.into_iter().find(says)
}

/// sysctl.d's leading minus is about errors, and its spaces about nothing.
fn words(line: &str) -> Vec<String> {
    let line = line.trim().trim_start_matches('-').replace(" = ", "=");
    line.split_whitespace().map(str::to_owned).collect()
}
