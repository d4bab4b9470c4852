//! Functions of the C header for signal handlers: they call only what POSIX calls async-signal-safe.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// Functions that the header says may be called in a signal handler.
const FOR_HANDLERS: [&str; 9] = [
    "phantom_send_stop",
    "phantom_emergency_stop",
    "phantom_stop",
    "phantom_clear_fault",
    "phantom_zero",
    "phantom_end_lease",
    "phantom_latest_tick",
    "phantom_read_frame",
    "phantom_is_attached",
];

/// POSIX.1-2024, System Interfaces, 2.4.3: those of its list that the header calls.
const SAFE: [&str; 17] = [
    "clock_gettime",
    "close",
    "connect",
    "geteuid",
    "getsockopt",
    "memcpy",
    "memset",
    "open",
    "poll",
    "readlink",
    "recvmsg",
    "send",
    "sendto",
    "setsockopt",
    "socket",
    "strlen",
    "strrchr",
];

/// Part of the language, and macros that only reckon.
const NO_CALLS: [&str; 18] = [
    "if",
    "for",
    "while",
    "switch",
    "return",
    "sizeof",
    "offsetof",
    "va_start",
    "va_arg",
    "va_end",
    "UINT64_C",
    "CMSG_DATA",
    "CMSG_FIRSTHDR",
    "CMSG_LEN",
    "CMSG_NXTHDR",
    "CMSG_SPACE",
    "__atomic_load_n",
    "__atomic_thread_fence",
];

fn header() -> String {
    std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("include/phantom3_client.h")).unwrap()
}

/// The header without its comments and the insides of its strings.
fn code(header: &str) -> String {
    let mut code = String::new();
    let mut rest = header;
    while let Some(at) = rest.find(['"', '/']) {
        code.push_str(&rest[..at]);
        rest = &rest[at..];
        let end = match rest.as_bytes() {
            [b'/', b'*', ..] => rest[2..].find("*/").unwrap() + 4,
            [b'"', ..] => rest[1..].find('"').unwrap() + 2,
            _ => {
                code.push('/');
                1
            }
        };
        rest = &rest[end..];
    }
    code + rest
}

/// Names that something in round brackets follows.
fn called(body: &str) -> BTreeSet<String> {
    let is_of_name = |character: char| character.is_ascii_alphanumeric() || character == '_';
    let before = body.match_indices('(').map(|(at, _)| body[..at].trim_end());
    before
        .map(|text| text[text.trim_end_matches(is_of_name).len()..].to_string())
        .filter(|name| !name.is_empty())
        .collect()
}

/// Calls of each function of the header.
fn functions(code: &str) -> BTreeMap<String, BTreeSet<String>> {
    let texts = code.split("\nstatic inline ").skip(1);
    texts
        .map(|text| {
            let (head, rest) = text.split_once('(').unwrap();
            let name = head.rsplit([' ', '*']).next().unwrap();
            let (_, body) = rest.split_once('{').unwrap();
            let is_of_one_line = body.lines().next().unwrap().ends_with('}');
            let (body, _) = body.split_once(if is_of_one_line { "}" } else { "\n}" }).unwrap();
            (name.to_string(), called(body))
        })
        .collect()
}

/// Everything that is called, directly or not, and is no function of the header.
fn called_outside(name: &str, functions: &BTreeMap<String, BTreeSet<String>>) -> BTreeSet<String> {
    let (mut open, mut seen, mut outside) = (vec![name.to_string()], BTreeSet::new(), BTreeSet::new());
    while let Some(name) = open.pop() {
        match functions.get(&name) {
            Some(calls) if seen.insert(name.clone()) => open.extend(calls.iter().cloned()),
            Some(_) => {}
            None => drop(outside.insert(name)),
        }
    }
    outside
}

#[test]
fn what_signal_handlers_may_call_calls_only_what_is_async_signal_safe() {
    let header = header();
    let functions = functions(&code(&header));
    let (promise, _) = header.split_once("#ifndef PHANTOM3_CLIENT_H").unwrap();
    let (_, promise) = promise.split_once("* Signal handlers may call").unwrap();
    for name in FOR_HANDLERS {
        assert!(promise.contains(name), "the header does not say that {name} is for signal handlers");
        assert!(functions.contains_key(name), "the header has no {name}");
        let mut found = called_outside(name, &functions);
        found.retain(|name| !SAFE.contains(&name.as_str()) && !NO_CALLS.contains(&name.as_str()));
        assert!(
            found.is_empty(),
            "{name} calls {found:?}, which is none of POSIX' async-signal-safe functions"
        );
    }
}

/// Else the test above would find nothing anywhere.
#[test]
fn what_is_not_async_signal_safe_is_found_through_other_functions() {
    let functions = functions(&code(&header()));
    let attaching = called_outside("phantom_attach", &functions);
    for name in ["snprintf", "strerror", "mmap", "recvmsg"] {
        assert!(attaching.contains(name), "phantom_attach calls {name}: {attaching:?}");
    }
}
