//! The kernel's command line, for the boot loader that is there.
//!
//! A key that stands on the line already, from `install.sh` or by hand, keeps its value: two values for one key would
//! replace one another, and which of them counts depends on the key.

use super::super::machine::Machine;
use super::super::step::{Action, Step};
use super::{PlanNames, Script, is_plain, quoted};

/// A word for the command line.
struct Word<'a> {
    what: &'a str,
    word: String,
    former: Option<String>,
}

pub(super) fn write(script: &mut Script, machine: &Machine<'_>, steps: &[Step], names: &PlanNames) {
    let words = words_of(steps);
    if words.is_empty() {
        return;
    }
    script.section("Kernel command line, from the next boot on");
    let (standing, new): (Vec<&Word<'_>>, Vec<&Word<'_>>) =
        words.iter().partition(|word| word.former.is_some());
    for word in &standing {
        let former = word.former.as_deref().unwrap_or_default();
        script.comment(&format!(
            "by hand, {}: {}; it is booted with \"{former}\" there now: change that where it stands",
            word.word, word.what
        ));
    }
    new.iter().for_each(|word| script.comment(&format!("{}: {}", word.word, word.what)));
    let new: Vec<&str> = new.iter().map(|word| word.word.as_str()).collect();
    if !new.is_empty() {
        add(script, machine, &new, names);
    }
}

fn add(script: &mut Script, machine: &Machine<'_>, words: &[&str], names: &PlanNames) {
    let line = words.join(" ");
    let exists = |path: &str| machine.exists(path);
    if exists("/etc/default/grub") && ["/usr/sbin/update-grub", "/sbin/update-grub"].into_iter().any(exists) {
        grub_drop_in(script, words, names);
    } else if ["/usr/sbin/grubby", "/sbin/grubby", "/usr/bin/grubby"].into_iter().any(exists) {
        script.explain(
            "adds them to every boot entry",
            &format!("grubby --update-kernel=ALL --remove-args='{line}'"),
        );
        script.line(&format!("grubby --update-kernel=ALL --args='{line}'"));
    } else if exists("/etc/default/grub") {
        script.comment(
            "Add them to GRUB_CMDLINE_LINUX_DEFAULT in /etc/default/grub; undo: take them out again:",
        );
        script.comment(&line);
        script.comment("then: grub-mkconfig -o /boot/grub/grub.cfg (grub2-mkconfig -o /boot/grub2/grub.cfg)");
    } else if exists("/etc/kernel/cmdline") {
        one_line_file(script, "/etc/kernel/cmdline", &line, names);
        script.line("kernel-install add \"$(uname -r)\" \"/boot/vmlinuz-$(uname -r)\"");
    } else if exists("/boot/firmware/cmdline.txt") {
        one_line_file(script, "/boot/firmware/cmdline.txt", &line, names);
    } else {
        script.comment(
            "No boot loader was found that this plan knows; whatever starts the kernel should give it:",
        );
        script.comment(&line);
    }
}

/// Each key once; the first to ask for it wins.
fn words_of(steps: &[Step]) -> Vec<Word<'_>> {
    let mut keys = Vec::new();
    let mut words = Vec::new();
    for step in steps {
        let Action::Boot { key, value, former } = &step.action else { continue };
        if keys.contains(key) || !(value.is_empty() || is_plain(value)) {
            continue;
        }
        keys.push(key);
        let word = if value.is_empty() { (*key).to_owned() } else { format!("{key}={value}") };
        words.push(Word { what: &step.what, word, former: former.clone() });
    }
    words
}

/// GRUB reads these files in the order of their names: this one last, when it can see what the others say.
fn grub_drop_in(script: &mut Script, words: &[&str], names: &PlanNames) {
    let path = format!("/etc/default/grub.d/zz-{}.cfg", names.prefix);
    let lines: Vec<String> = words.iter().map(|word| grub_line(word)).collect();
    script.explain("adds them for GRUB, each unless its key is there", &format!("rm {path} && update-grub"));
    script.file(&path, &lines);
    script.line("update-grub");
}

/// Shell, as all of GRUB's defaults.
fn grub_line(word: &str) -> String {
    const LINE: &str = "GRUB_CMDLINE_LINUX_DEFAULT";
    let key = key_of(word);
    format!(
        "case \" $GRUB_CMDLINE_LINUX ${LINE} \" in *\" {key}=\"* | *\" {key} \"*) ;; *) {LINE}=\"${LINE} {word}\" ;; esac"
    )
}

/// The line as it was first found is kept.
fn one_line_file(script: &mut Script, path: &str, line: &str, names: &PlanNames) {
    let kept = format!("{path}.before-{}", names.prefix);
    script
        .explain(&format!("adds them to {path}, each unless its key is there"), &format!("mv {kept} {path}"));
    script.line(&format!("[ -e {0} ] || cp {1} {0}", quoted(&kept), quoted(path)));
    script.line(&format!("for word in {line}; do"));
    script.line(&format!("    line=$(cat {})", quoted(path)));
    script.line("    case \" $line \" in *\" ${word%%=*}=\"* | *\" ${word%%=*} \"*) continue ;; esac");
    script.line(&format!("    printf '%s %s\\n' \"$line\" \"$word\" > {}", quoted(path)));
    script.line("done");
}

fn key_of(word: &str) -> &str {
    word.split_once('=').map_or(word, |(key, _)| key)
}
