//! The kernel's command line, for the boot loader that is there.

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
    for word in &words {
        let former = word.former.as_deref().map_or_else(String::new, |former| {
            format!("; it is booted with \"{former}\" there now: take that out where it stands")
        });
        script.comment(&format!("{}: {}{former}", word.word, word.what));
    }
    let line: Vec<&str> = words.iter().map(|word| word.word.as_str()).collect();
    let line = line.join(" ");
    let exists = |path: &str| machine.exists(path);
    if exists("/etc/default/grub") && ["/usr/sbin/update-grub", "/sbin/update-grub"].into_iter().any(exists) {
        grub_drop_in(script, &line, names);
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

fn grub_drop_in(script: &mut Script, line: &str, names: &PlanNames) {
    let path = format!("/etc/default/grub.d/{}.cfg", names.prefix);
    script.explain("adds them for GRUB", &format!("rm {path} && update-grub"));
    script.file(&path, &[format!("GRUB_CMDLINE_LINUX_DEFAULT=\"$GRUB_CMDLINE_LINUX_DEFAULT {line}\"")]);
    script.line("update-grub");
}

/// Keeps the former file, and starts from that each time: running the script twice adds nothing twice.
fn one_line_file(script: &mut Script, path: &str, line: &str, names: &PlanNames) {
    let kept = format!("{path}.before-{}", names.prefix);
    script.explain(&format!("adds them to {path}"), &format!("mv {kept} {path}"));
    script.line(&format!("[ -e {0} ] || cp {1} {0}", quoted(&kept), quoted(path)));
    script.line(&format!("printf '%s %s\\n' \"$(cat {})\" '{line}' > {}", quoted(&kept), quoted(path)));
}
