//! The doctor's questions about cards and about the driver's socket, on recorded machines and made-up answers.

use crate::machines;

use io_driver::doctor::segment::Answer;
use io_driver::doctor::{self, device, segment, to_json};
use machines::{complaints, load, load_with, spec};
use proptest::prelude::*;
use rt_core::doctor::Finding;
use rt_core::doctor::Verdict::{self, Fail, Pass, Unreadable, Warn};
use rt_core::doctor::machine::Machine;
use rt_core::doctor::plan::{self, PlanNames};
use rt_core::doctor::recorded::RecordedMachine;
use shm_abi::client::AttachError;
use std::path::{Path, PathBuf};

const SOCKET: &str = "/run/user/1000/phantom3/driver.sock";

fn device_findings(recorded: &RecordedMachine) -> Vec<Finding> {
    device::examine(&Machine { tree: recorded, probes: recorded, spec: &spec(3) })
}

/// Id, subject, verdict, words of what was found.
type Expected<'a> = (&'a str, Option<&'a str>, Verdict, &'a str);

#[track_caller]
fn check_devices(name: &str, changes: &str, expected: &[Expected<'_>]) {
    let findings = device_findings(&load_with(name, changes));
    for (id, subject, verdict, found) in expected {
        let judgement = findings
            .iter()
            .map(|finding| (finding.id, &finding.judgement))
            .find(|(other, judgement)| other == id && judgement.subject.as_deref() == *subject)
            .unwrap_or_else(|| panic!("no {id} for {subject:?}: {findings:?}"))
            .1;
        assert_eq!(judgement.verdict, *verdict, "{id}, {changes}: {judgement:?}");
        assert!(judgement.found.contains(found), "{id}, {changes}: {judgement:?}");
        assert_eq!(judgement.remedy.is_none(), *verdict == Pass, "{judgement:?}");
    }
}

#[test]
fn no_card_is_a_plain_note() {
    check_devices(
        "lab-rt",
        "",
        &[("device.cards", None, Pass, "none found"), ("device.lockdown", None, Pass, "none")],
    );
    assert_eq!(device_findings(&load("lab-rt")).len(), 2, "nothing is asked of cards that are not there");
}

#[test]
fn a_phantom_that_the_kernels_module_holds_is_to_be_freed_and_opened_to_the_group() {
    let card = Some("0000:05:02.0");
    let expected = [
        ("device.cards", None, Pass, "PHANToM PCI card at 0000:05:02.0"),
        ("device.card_enabled", card, Pass, "yes"),
        ("device.card_driver", card, Fail, "kernel driver phantom"),
        ("device.card_iommu", card, Pass, "group 14"),
        ("device.card_access", card, Fail, "resource0 mode 0600, owner 0, group 0: not for user 1000"),
        ("device.card_cookie", card, Pass, "this card has none"),
    ];
    check_devices("phantom-bound", "", &expected);
    let rule = "=== /sys/bus/pci/devices/0000:05:02.0/resource2 mode 0666\n=== /sys/bus/pci/devices/0000:05:02.0/resource0 mode 0660 gid 990\n";
    check_devices(
        "phantom-bound",
        rule,
        &[("device.card_access", card, Fail, "resource2 mode 0666, owner 0, group 0: anybody")],
    );
    let freed = "=== /sys/bus/pci/devices/0000:05:02.0/driver removed\n";
    check_devices("phantom-bound", freed, &[("device.card_driver", card, Pass, "no kernel driver")]);
    let vfio = "=== /sys/bus/pci/devices/0000:05:02.0/driver -> ../../../bus/pci/drivers/vfio-pci\n";
    check_devices("phantom-bound", vfio, &[("device.card_driver", card, Pass, "vfio-pci")]);
    let root = "=== /proc/self/status\nUid:\t0\t0\t0\t0\nGid:\t0\t0\t0\t0\nGroups:\t0\n";
    check_devices("phantom-bound", root, &[("device.card_access", card, Pass, "root may")]);
}

#[test]
fn a_mesa_that_is_not_enabled_is_to_be_enabled_and_the_other_plx_card_is_none_of_ours() {
    let card = Some("0000:04:00.0");
    let expected = [
        ("device.cards", None, Pass, "Mesa 5i25 at 0000:04:00.0"),
        ("device.card_enabled", card, Fail, "no"),
        ("device.card_driver", card, Pass, "no kernel driver"),
        ("device.card_iommu", card, Pass, "group 12"),
        ("device.card_access", card, Pass, "this user may"),
        ("device.card_cookie", card, Unreadable, "not enabled"),
    ];
    check_devices("mesa-disabled", "", &expected);
    assert_eq!(device_findings(&load("mesa-disabled")).len(), 7, "one card");
}

#[test]
fn a_mesa_that_is_enabled_is_asked_for_its_cookie() {
    let (card, id) = (Some("0000:04:00.0"), "device.card_cookie");
    for (word, verdict, found) in [
        ("word=55aacafe", Pass, "0x55aacafe"),
        ("word=ffffffff", Fail, "does not answer"),
        ("word=00000000", Fail, "0x00000000, expected 0x55aacafe"),
        ("error Permission denied", Unreadable, "Permission denied"),
        ("word=nonsense", Unreadable, "not recorded"),
    ] {
        let changes = format!(
            "=== /sys/bus/pci/devices/0000:04:00.0/enable\n1\n\
             === probe word /sys/bus/pci/devices/0000:04:00.0/resource0 0x100\n{word}\n"
        );
        check_devices("mesa-disabled", &changes, &[(id, card, verdict, found)]);
    }
}

#[test]
fn lockdown_is_a_failure_with_a_card_and_a_warning_without() {
    const LOCKDOWN: &str = "/sys/kernel/security/lockdown";
    let id = "device.lockdown";
    check_devices("secure-boot", "", &[(id, None, Fail, "integrity: the card cannot be mapped")]);
    check_devices(
        "secure-boot",
        "",
        &[("device.card_iommu", Some("0000:03:00.0"), Warn, "none, so VFIO cannot")],
    );
    for (changes, verdict, found) in [
        (format!("=== {LOCKDOWN}\nnone integrity [confidentiality]\n"), Warn, "confidentiality: no card"),
        (format!("=== {LOCKDOWN}\nzebra\n"), Unreadable, "makes no sense"),
        (format!("=== {LOCKDOWN}\n[zebra]\n"), Unreadable, "makes no sense"),
        (format!("=== {LOCKDOWN} removed\n"), Unreadable, "does not exist"),
        (
            format!("=== {LOCKDOWN} removed\n=== /sys/kernel/security/lsm\ncapability\n"),
            Pass,
            "this kernel has none",
        ),
        ("=== /sys/kernel/security denied\n".to_owned(), Unreadable, "permission denied"),
    ] {
        check_devices("lab-rt", &changes, &[(id, None, verdict, found)]);
    }
}

#[test]
fn ids_that_make_no_sense_are_not_taken_for_the_absence_of_cards() {
    for content in ["zebra", "10b5", ""] {
        let changes = format!("=== /sys/bus/pci/devices/0000:05:02.0/vendor\n{content}\n");
        check_devices("phantom-bound", &changes, &[("device.cards", None, Unreadable, "makes no sense")]);
    }
    for file in ["enable", "resource0"] {
        let changes = format!("=== /sys/bus/pci/devices/0000:05:02.0/{file} removed\n");
        let id = if file == "enable" { "device.card_enabled" } else { "device.card_access" };
        check_devices("phantom-bound", &changes, &[(id, Some("0000:05:02.0"), Unreadable, "does not exist")]);
    }
    let status = "=== /proc/self/status\nUid:\tx\n";
    check_devices(
        "phantom-bound",
        status,
        &[("device.card_access", Some("0000:05:02.0"), Unreadable, "no sense")],
    );
}

fn no_driver() -> Answer {
    Err(AttachError::NoDriver { socket: SOCKET.into() })
}

/// Each of the four questions: id, verdict, words.
#[track_caller]
fn check_segment(changes: &str, answer: &Answer, expected: &[(&str, Verdict, &str)]) {
    let recorded = load_with("lab-rt", changes);
    let findings =
        segment::examine(&Machine { tree: &recorded, probes: &recorded, spec: &spec(3) }, SOCKET, answer);
    for (id, verdict, found) in expected {
        let judgement = &machines::find(&findings, id).judgement;
        assert_eq!(judgement.verdict, *verdict, "{id}: {judgement:?}");
        assert!(judgement.found.contains(found), "{id}: {judgement:?}");
    }
}

#[test]
fn without_a_driver_everything_is_ready_for_one() {
    let expected = [
        ("segment.directory", Pass, "/run/user/1000/phantom3, mode 0750, owner 1000"),
        ("segment.socket", Pass, "no driver is running"),
        ("segment.abi", Pass, "no driver to compare with"),
        ("segment.reach", Pass, "nobody"),
    ];
    check_segment("", &no_driver(), &expected);
}

#[test]
fn a_driver_that_answers_is_named() {
    let socket = format!("=== {SOCKET} mode 0660 uid 1000 gid 1000\n");
    let expected = [
        ("segment.socket", Pass, "process 4242"),
        ("segment.abi", Pass, "the driver's too"),
        ("segment.reach", Pass, "mode 0660, owner 1000, group 1000: the owner, the group and root"),
    ];
    check_segment(&socket, &seen(4242), &expected);
}

fn seen(pid: u64) -> Answer {
    Ok(segment::Seen { pid, not_zeroed: Vec::new() })
}

#[test]
fn devices_that_wait_to_be_zeroed_are_told_and_are_no_obstacle() {
    check_segment("", &seen(1), &[("segment.zeroed", Pass, "every device knows where it is")]);
    let waiting = segment::Seen { pid: 1, not_zeroed: vec!["left".into(), "right".into()] };
    check_segment("", &Ok(waiting), &[("segment.zeroed", Warn, "not zeroed: left, right")]);
    check_segment("", &no_driver(), &[("segment.zeroed", Pass, "no driver was asked")]);
}

#[test]
fn each_way_of_not_answering_has_its_own_verdict() {
    let socket = || PathBuf::from(SOCKET);
    let cases: [(AttachError, Verdict, &str, Verdict, &str); 7] = [
        (AttachError::DriverGone { socket: socket() }, Warn, "has no listener", Pass, "no driver to compare"),
        (
            AttachError::NoAnswer { socket: socket(), seconds: 2 },
            Fail,
            "does not answer within 2 s",
            Unreadable,
            "did not say",
        ),
        (
            AttachError::WrongVersion { found: "2.0".into(), expected: "1.0".into() },
            Pass,
            "a driver answers",
            Fail,
            "the driver's is 2.0, ours 1.0",
        ),
        (
            AttachError::WrongLayout { found: 1, expected: 2, version: "1.0".into() },
            Pass,
            "a driver answers",
            Fail,
            "layout is 0x0000000000000001",
        ),
        (
            AttachError::NotADriver { socket: socket(), detail: "it is not a socket".into() },
            Fail,
            "not a driver's socket: it is not a socket",
            Unreadable,
            "did not say",
        ),
        (
            AttachError::NoPermission { socket: socket(), mode: 0o600, owner: 0, group: 0, user: 1000 },
            Unreadable,
            "no permission",
            Unreadable,
            "did not say",
        ),
        (
            AttachError::Refused("it has too many connections".into()),
            Unreadable,
            "too many",
            Unreadable,
            "did not say",
        ),
    ];
    for (error, verdict, found, version, version_found) in cases {
        let expected = [("segment.socket", verdict, found), ("segment.abi", version, version_found)];
        check_segment("", &Err(error), &expected);
    }
}

#[test]
fn the_directory_is_judged_by_who_may_write_there() {
    let id = "segment.directory";
    let gone = "=== /run/user/1000/phantom3 removed\n";
    check_segment(gone, &no_driver(), &[(id, Pass, "the driver makes it")]);
    let nothing = "=== /run/user removed\n";
    check_segment(nothing, &no_driver(), &[(id, Warn, "does not exist")]);
    let open = "=== /run/user/1000/phantom3/ mode 0777\n";
    check_segment(open, &no_driver(), &[(id, Fail, "anybody can put a socket of their own there")]);
    let sticky = "=== /run/user/1000/phantom3/ mode 1777\n";
    check_segment(sticky, &no_driver(), &[(id, Pass, "mode 1777")]);
    let file = "=== /run/user/1000/phantom3 removed\n=== /run/user/1000/phantom3\nx\n";
    check_segment(file, &no_driver(), &[(id, Fail, "is no directory")]);
    let hidden = "=== /run/user denied\n";
    check_segment(
        hidden,
        &no_driver(),
        &[(id, Unreadable, "permission denied"), ("segment.reach", Unreadable, "permission denied")],
    );
}

#[test]
fn a_socket_that_every_user_can_reach_is_told() {
    let open = format!("=== {SOCKET} mode 0666 uid 1000 gid 1000\n");
    check_segment(&open, &seen(1), &[("segment.reach", Pass, "mode 0666")]);
    let passable = "=== /run/user/1000/ mode 0755\n=== /run/user/1000/phantom3/ mode 0755\n";
    check_segment(&(open + passable), &seen(1), &[("segment.reach", Warn, "every user of this machine")]);
}

fn whole(recorded: &RecordedMachine) -> Vec<Finding> {
    doctor::examine(&Machine { tree: recorded, probes: recorded, spec: &spec(3) }, SOCKET, &no_driver())
}

fn plan_of(recorded: &RecordedMachine) -> String {
    let names = PlanNames {
        prefix: "phantom3-plan".into(),
        program: "/usr/local/bin/io-driver".into(),
        unit_prefixes: vec![],
    };
    plan::script(&Machine { tree: recorded, probes: recorded, spec: &spec(3) }, &whole(recorded), &names)
}

/// With DOCTOR_BLESS set, writes the files anew: look at the difference then.
#[test]
fn the_plans_for_the_cards_are_the_committed_ones() {
    for name in ["phantom-bound", "mesa-disabled"] {
        let directory =
            Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap().join("rt-core/tests/machines");
        let (path, script) = (directory.join(format!("{name}.plan.sh")), plan_of(&load(name)));
        if std::env::var_os("DOCTOR_BLESS").is_some() {
            std::fs::write(&path, &script).unwrap();
        }
        assert!(script == std::fs::read_to_string(&path).unwrap(), "{name}:\n{script}");
    }
}

/// What the plans for the cards say, done to the recorded machines.
#[test]
fn doing_what_the_plans_say_makes_the_cards_pass() {
    let mut phantom = load("phantom-bound");
    assert!(plan_of(&phantom).contains("put 0000:05:02.0 /sys/bus/pci/drivers/phantom/unbind"));
    phantom.remove("/sys/bus/pci/devices/0000:05:02.0/driver");
    let rule =
        "RUN+=\"/bin/chgrp phantom3 /sys$devpath/resource0 /sys$devpath/resource2 /sys$devpath/resource3\"";
    assert!(plan_of(&phantom).contains(rule));
    let permitted: String = [0, 2, 3]
        .map(|bar| format!("=== /sys/bus/pci/devices/0000:05:02.0/resource{bar} mode 0660 gid 990\n"))
        .concat();
    let freed = "=== /sys/bus/pci/devices/0000:05:02.0/driver removed\n";
    assert_eq!(complaints(&whole(&load_with("phantom-bound", &(permitted + freed)))), []);

    let mut mesa = load("mesa-disabled");
    assert!(plan_of(&mesa).contains("put 1 /sys/bus/pci/devices/0000:04:00.0/enable"));
    mesa.set("/sys/bus/pci/devices/0000:04:00.0/enable", "1\n");
    let word = "word /sys/bus/pci/devices/0000:04:00.0/resource0 0x100";
    mesa.probes.insert(word.to_owned(), "word=55aacafe".into());
    assert_eq!(complaints(&whole(&mesa)), []);
}

#[test]
fn json_has_stable_ids_verdicts_and_the_loop() {
    let recorded = load("phantom-bound");
    let value: serde_json::Value = serde_json::from_str(&to_json(&whole(&recorded), &spec(3))).unwrap();
    assert_eq!(value["schema"], 1);
    assert_eq!(value["loop"]["cpu"], 3);
    assert_eq!(value["loop"]["fifo_priority"], 80);
    assert_eq!(value["summary"]["fail"], 2);
    let findings = value["findings"].as_array().unwrap();
    let owner = findings.iter().find(|finding| finding["id"] == "device.card_driver").unwrap();
    assert_eq!(owner["subject"], "0000:05:02.0");
    assert_eq!(owner["verdict"], "fail");
    assert!(owner["remedy"].as_str().unwrap().contains("unbind"));
    let realtime = findings.iter().find(|finding| finding["id"] == "kernel.realtime").unwrap();
    assert_eq!((&realtime["verdict"], &realtime["remedy"]), (&"pass".into(), &serde_json::Value::Null));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(100))]

    #[test]
    fn any_bytes_in_any_files_of_the_cards_never_panic_and_binary_ones_never_pass_for_no_cards(
        changes in proptest::collection::vec((any::<prop::sample::Index>(), any::<Vec<u8>>()), 1..8),
    ) {
        for name in ["phantom-bound", "mesa-disabled", "secure-boot"] {
            let mut machine = load(name);
            let files: Vec<String> =
                machine.files.keys().filter(|path| path.starts_with("/sys/bus/pci")).cloned().collect();
            for (index, content) in &changes {
                machine.set(index.get(&files).as_str(), content.clone());
            }
            let _ = (to_json(&whole(&machine), &spec(3)), plan_of(&machine));
        }
    }

    #[test]
    fn garbage_in_a_cards_ids_never_passes(garbage in "[^0]{1,12}") {
        for file in ["vendor", "device", "subsystem_vendor", "subsystem_device"] {
            let mut machine = load("phantom-bound");
            machine.set(&format!("/sys/bus/pci/devices/0000:05:02.0/{file}"), garbage.as_bytes());
            let findings = device_findings(&machine);
            prop_assert_eq!(machines::find(&findings, "device.cards").verdict(), Unreadable);
        }
    }
}
