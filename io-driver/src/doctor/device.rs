//! Can the driver reach the cards? Lockdown, and for each card: enabled, free, permitted, alive.

use super::card::{Card, cards};
use super::user::User;
use rt_core::doctor::machine::{Machine, Obstacle, one_line};
use rt_core::doctor::step::{Action, Step};
use rt_core::doctor::{Check, Finding, Judged, Judgement, Remedy};
use rt_core::installed::GROUP as REAL_TIME_GROUP;

const GROUP: &str = "device";

const LOCKDOWN: Check = Check {
    id: "device.lockdown",
    title: "kernel lockdown",
    why: "Under lockdown, which Secure Boot switches on, nobody may map a PCI card's registers, root included.",
    run: lockdown,
};

const CARDS: Check = Check {
    id: "device.cards",
    title: "haptic cards",
    why: "A card that is not seen on the bus is not plugged in well, not powered, or hidden by the firmware.",
    run: found_cards,
};

/// Of each card; `run` is never asked for more than one, see [`examine`].
struct CardCheck {
    id: &'static str,
    title: &'static str,
    why: &'static str,
    run: fn(&Machine<'_>, &Card) -> Judged,
}

const CARD_CHECKS: [CardCheck; 5] = [
    CardCheck {
        id: "device.card_enabled",
        title: "enabled",
        why: "The registers of a card that is not enabled read as all ones and take no write.",
        run: enabled,
    },
    CardCheck {
        id: "device.card_driver",
        title: "owner",
        why: "A kernel driver that holds the card writes to it as well: two masters of the same motors.",
        run: owner,
    },
    CardCheck {
        id: "device.card_iommu",
        title: "IOMMU group",
        why: "With an IOMMU group the card can be handed over by VFIO, which works under lockdown too.",
        run: iommu_group,
    },
    CardCheck {
        id: "device.card_access",
        title: "permissions",
        why: "The driver maps the card's registers through these files; whoever else may, can move the motors.",
        run: access,
    },
    CardCheck {
        id: "device.card_cookie",
        title: "identification",
        why: "The card's firmware answers with a fixed word; anything else is a card that is not configured or dead.",
        run: cookie,
    },
];

/// Lockdown, the list of cards, and each card.
pub fn examine(machine: &Machine<'_>) -> Vec<Finding> {
    let mut findings = vec![LOCKDOWN.examine(GROUP, machine), CARDS.examine(GROUP, machine)];
    // If they cannot be listed, the line before says so.
    for card in cards(machine).unwrap_or_default() {
        for check in &CARD_CHECKS {
            let judgement = (check.run)(machine, &card).unwrap_or_else(Judgement::from);
            let judgement = judgement.about(one_line(&card.address, 16));
            let CardCheck { id, title, why, .. } = *check;
            findings.push(Finding { group: GROUP, id, title, why, judgement });
        }
    }
    findings
}

const LOCKDOWN_FILE: &str = "/sys/kernel/security/lockdown";

/// The lockdown in force; none where the kernel has no lockdown.
fn lockdown_mode(machine: &Machine<'_>) -> Result<Option<String>, Obstacle> {
    match machine.chosen(LOCKDOWN_FILE) {
        Ok(mode) if matches!(mode.as_str(), "none" | "integrity" | "confidentiality") => Ok(Some(mode)),
        Ok(mode) => Err(Obstacle::garbled(LOCKDOWN_FILE, &mode)),
        Err(Obstacle::Absent(path)) => match machine.exists("/sys/kernel/security/lsm") {
            true => Ok(None),
            // The file system is not mounted, or the kernel has none.
            false => Err(Obstacle::Absent(path)),
        },
        Err(obstacle) => Err(obstacle),
    }
}

fn lockdown(machine: &Machine<'_>) -> Judged {
    let mode = match lockdown_mode(machine) {
        Ok(mode) => mode,
        Err(Obstacle::Absent(path)) => {
            let text = "mount -t securityfs none /sys/kernel/security";
            return Ok(Judgement::unreadable(format!("{path} does not exist"), Remedy::words(text)));
        }
        Err(obstacle) => return Err(obstacle),
    };
    match mode.as_deref() {
        None => Ok(Judgement::pass("this kernel has none")),
        Some("none") => Ok(Judgement::pass("none")),
        Some(mode) => {
            let text = "switch Secure Boot off in the firmware's setup (or take lockdown= off the kernel's command \
                        line), or hand the card over by VFIO";
            let remedy = Remedy::steps(text, [Step::by_hand(text)]);
            let has_cards = cards(machine).is_ok_and(|cards| !cards.is_empty());
            Ok(match has_cards {
                true => Judgement::fail(format!("{mode}: the card cannot be mapped"), remedy),
                false => Judgement::warn(format!("{mode}: no card could be mapped"), remedy),
            })
        }
    }
}

fn found_cards(machine: &Machine<'_>) -> Judged {
    let cards = cards(machine)?;
    let names: Vec<String> =
        cards.iter().map(|card| format!("{} at {}", card.model.name, one_line(&card.address, 16))).collect();
    Ok(Judgement::pass(if names.is_empty() { "none found".to_owned() } else { names.join(", ") }))
}

fn enabled(machine: &Machine<'_>, card: &Card) -> Judged {
    let path = card.file("enable");
    // Counts those who enabled it.
    let users: i64 = machine.number(&path)?;
    if users > 0 {
        return Ok(Judgement::pass("yes"));
    }
    let put = Step {
        what: format!("enable the {}", card.model.name),
        action: Action::Put { path: path.clone(), value: "1".into(), former: "0".into(), lasting: false },
    };
    Ok(Judgement::fail("no", Remedy::steps(format!("echo 1 > {path}"), [put, enable_at_boot(card)])))
}

fn enable_at_boot(card: &Card) -> Step {
    let rule = format!("{}, ATTR{{enable}}=\"1\"", card.udev_match());
    Step::udev(&format!("enable the {} at each boot", card.model.name), rule)
}

fn owner(machine: &Machine<'_>, card: &Card) -> Judged {
    match machine.link_name(&card.file("driver")).as_deref() {
        None => Ok(Judgement::pass("no kernel driver")),
        Some("vfio-pci") => Ok(Judgement::pass("vfio-pci, which hands it over")),
        // A driver that lets go of its card disables it.
        Some(driver) => {
            let text = format!(
                "echo {} > /sys/bus/pci/drivers/{driver}/unbind, enable the card again, and \"blacklist {driver}\" in /etc/modprobe.d",
                card.address
            );
            let step = Step {
                what: format!("take the {} from the kernel's driver", card.model.name),
                action: Action::Unbind { address: card.address.clone(), driver: driver.to_owned() },
            };
            Ok(Judgement::fail(
                format!("kernel driver {driver}"),
                Remedy::steps(text, [step, enable_at_boot(card)]),
            ))
        }
    }
}

fn iommu_group(machine: &Machine<'_>, card: &Card) -> Judged {
    if let Some(group) = machine.link_name(&card.file("iommu_group")) {
        return Ok(Judgement::pass(format!("group {group}")));
    }
    // What cannot be known is told by the check of lockdown.
    if !matches!(lockdown_mode(machine), Ok(Some(mode)) if mode != "none") {
        return Ok(Judgement::pass("none, and none needed without lockdown"));
    }
    let text = "boot with intel_iommu=on (AMD: on by default, see the firmware's setup)";
    let former = machine.boot_parameter("intel_iommu")?;
    let step = Step::boot("switch the IOMMU on, for VFIO (Intel)", "intel_iommu", "on", former);
    Ok(Judgement::warn("none, so VFIO cannot hand it over", Remedy::steps(text, [step])))
}

fn access(machine: &Machine<'_>, card: &Card) -> Judged {
    let user = User::of(machine)?;
    for bar in card.model.bars {
        let path = card.resource(*bar);
        let status = machine.status(&path)?;
        let mode = status.mode & 0o777;
        let found = format!("resource{bar} mode {mode:04o}, owner {}, group {}", status.uid, status.gid);
        if mode & 0o002 != 0 {
            let text = format!("chmod o-rwx {path}, and look for the udev rule that did this");
            return Ok(Judgement::fail(format!("{found}: anybody can move the motors"), Remedy::words(text)));
        }
        if !user.may_write(&status) {
            return Ok(Judgement::fail(format!("{found}: not for user {}", user.uid), permit(card)));
        }
    }
    Ok(Judgement::pass(match user.uid {
        0 => "root may",
        _ => "this user may",
    }))
}

fn permit(card: &Card) -> Remedy {
    let files: Vec<String> =
        card.model.bars.iter().map(|bar| format!("/sys$devpath/resource{bar}")).collect();
    let files = files.join(" ");
    let rule = format!(
        "{}, RUN+=\"/bin/chgrp {REAL_TIME_GROUP} {files}\", RUN+=\"/bin/chmod 0660 {files}\"",
        card.udev_match()
    );
    let what = format!("let the group map the {}", card.model.name);
    Remedy::steps(format!("run as root, or a udev rule: {rule}"), [Step::udev(&what, rule)])
}

fn cookie(machine: &Machine<'_>, card: &Card) -> Judged {
    let Some((offset, expected)) = card.model.cookie else {
        return Ok(Judgement::pass("this card has none"));
    };
    if machine.number::<i64>(&card.file("enable"))? <= 0 {
        return Ok(Judgement::unreadable(
            "not read: the card is not enabled",
            Remedy::words("enable it first"),
        ));
    }
    match machine.probes.mapped_word(&card.resource(card.model.bars[0]), offset) {
        Ok(word) if word == expected => Ok(Judgement::pass(format!("{word:#010x}"))),
        Ok(u32::MAX) => {
            let text = "power the machine off and on; look whether the card sits well in its slot";
            Ok(Judgement::fail("0xffffffff: the card does not answer", Remedy::words(text)))
        }
        Ok(word) => {
            let text =
                "load a hostmot2 configuration into the card (mesaflash --device NAME --write FILE.bit)";
            Ok(Judgement::fail(format!("{word:#010x}, expected {expected:#010x}"), Remedy::words(text)))
        }
        Err(error) => {
            let text = "run the doctor as a user who may map the card; under lockdown nobody may";
            Ok(Judgement::unreadable(one_line(&error, 60), Remedy::words(text)))
        }
    }
}
