//! The fault campaign: random faults, alone and together, against real processes on a card whose amplifiers
//! check every value.
//!
//! ```text
//! cargo test --release -p system-tests --test faults campaign::campaign -- --nocapture
//! ```
//! plays a quarter of a minute of it and prints a table. `CAMPAIGN_SECONDS=3600` plays an hour, `CAMPAIGN_RUNS=500` so many
//! runs whatever the time, `CAMPAIGN_SEED=0x...` begins with another run: the one whose seed a failure tells,
//! with `CAMPAIGN_RUNS=1` it alone. What happens in a run is drawn from its seed and from nothing else; when a
//! blow falls within a tick is up to the machine.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};
use system_tests::driver::HANG;
use system_tests::faults::campaign::{self, HOG_TEST};
use system_tests::faults::heal::Account;
use system_tests::faults::hog;
use system_tests::faults::plan::{Plan, Strike, Then};
use system_tests::faults::process::{Running, myself, role};
use system_tests::faults::random::Random;

/// Where the usual campaign begins, so that a checkout that passes passes again.
const USUAL_SEED: u64 = 0x0070_6861_6e74_6f6d;
/// As long as a campaign lasts if nobody says.
const USUAL_SECONDS: u64 = 15;
/// Begins the line on which a run says what it saw.
const TELLS: &str = "the run saw ";

fn number(variable: &str) -> Option<u64> {
    let text = std::env::var(variable).ok()?;
    let parsed = match text.strip_prefix("0x") {
        Some(digits) => u64::from_str_radix(digits, 16),
        None => text.parse(),
    };
    Some(parsed.unwrap_or_else(|error| panic!("{variable}={text}: {error}")))
}

/// What a kind of strike went through.
#[derive(Default)]
struct Line {
    runs: u64,
    account: Account,
}

#[test]
fn campaign() {
    let first = number("CAMPAIGN_SEED").unwrap_or(USUAL_SEED);
    let runs = number("CAMPAIGN_RUNS");
    let seconds = number("CAMPAIGN_SECONDS").unwrap_or(if runs.is_some() { u64::MAX } else { USUAL_SECONDS });
    let (begun, mut seed, mut seeds) = (Instant::now(), first, Random::new(first));
    let (mut total, mut table) = (Line::default(), BTreeMap::<&str, Line>::new());
    while total.runs < runs.unwrap_or(u64::MAX) && begun.elapsed() < Duration::from_secs(seconds) {
        let plan = Plan::of(seed);
        let account = play(&plan).unwrap_or_else(|failure| {
            print(&table, &total, begun.elapsed());
            panic!("{failure}");
        });
        total.runs += 1;
        total.account.add(account);
        for name in plan.strikes.iter().map(|(_, strike, _)| strike.name()) {
            let line = table.entry(name).or_default();
            line.runs += 1;
            line.account.add(account);
        }
        seed = seeds.word();
    }
    assert!(total.runs > 0);
    print(&table, &total, begun.elapsed());
}

/// In a process of its own: a run that hangs or crashes takes nothing with it.
fn play(plan: &Plan) -> Result<Account, String> {
    println!("{plan}");
    let end = Running::start(&mut myself("campaign::the_run_of_one_plan", &plan.seed.to_string()))
        .end_within(4 * HANG);
    let account = end.out.split(TELLS).nth(1).and_then(|text| Account::from_line(text.lines().next()?));
    account.filter(|_| end.status == Some(0)).ok_or_else(|| {
        format!(
            "the run failed: {plan}\nplay it again: CAMPAIGN_SEED=0x{:016x} CAMPAIGN_RUNS=1 cargo test --release \
             -p system-tests --test faults campaign::campaign -- --nocapture\n{:?}\n{}\n{}",
            plan.seed, end.status, end.out, end.err
        )
    })
}

fn print(table: &BTreeMap<&str, Line>, total: &Line, took: Duration) {
    println!(
        "{:<24}{:>6}{:>12}{:>10}{:>8}{:>8}{:>8}",
        "in runs with", "runs", "values", "longest N", "trips", "last", "deaths"
    );
    for (name, line) in table.iter().map(|(name, line)| (*name, line)).chain([("all", total)]) {
        let Account { written, largest_force_un, trips, last_acts, deaths, .. } = line.account;
        let longest_n = largest_force_un as f64 / 1e6;
        println!(
            "{name:<24}{:>6}{written:>12}{longest_n:>10.3}{trips:>8}{last_acts:>8}{deaths:>8}",
            line.runs
        );
    }
    let Account { written, checked, judged_again, cleared, .. } = total.account;
    println!(
        "{} runs in {:.0} s: {written} values, {checked} checked by the amplifiers, {judged_again} judged once \
         more, none wrong, none lost; {cleared} faults cleared",
        total.runs,
        took.as_secs_f64()
    );
}

/// Not a test of its own: one run, for the test above.
#[test]
fn the_run_of_one_plan() {
    let Some(seed) = role() else { return };
    let plan = Plan::of(seed.parse().expect("a seed"));
    println!("{TELLS}{}", campaign::run(&plan).to_line());
}

/// Not a test of its own: the hog of a run.
#[test]
fn the_hog() {
    assert_eq!(HOG_TEST, "campaign::the_hog");
    if let Some(words) = role() {
        println!("{}", hog::take(&words));
    }
}

/// So that none depends on being drawn.
#[test]
fn every_kind_of_strike_alone() {
    for strike in Strike::each() {
        let strikes = vec![(3000, strike, Then::Heal)];
        let plan = Plan { seed: 1, peak_n: 8.5, slew_n_per_s: 400.0, strikes };
        println!("{plan}");
        let account = campaign::run(&plan);
        assert!(account.written > 0 && account.largest_force_un > 1_000_000, "{plan}: {account:?}");
    }
}

/// As many as the tests without amplifiers kill.
#[test]
fn forty_apps_killed_one_after_the_other_leave_no_value_wrong() {
    let strike = |index: u64| match index % 4 {
        0 => Strike::KillAppStarting(index * 500),
        _ => Strike::KillApp,
    };
    let strikes = (0..40).map(|index| (index * 200, strike(index), Then::Heal)).collect();
    let plan = Plan { seed: 2, peak_n: 3.0, slew_n_per_s: 400.0, strikes };
    let account = campaign::run(&plan);
    assert_eq!((account.deaths, account.last_acts), (0, 0), "the driver stays: {account:?}");
    assert_eq!(account.checked, account.written, "{account:?}");
}

/// Forces of any size, in any direction, in any bits: what reaches the motors keeps the limits in every run, and
/// uses them in one of at most eight. A machine that lets nobody run while they come shows the honest 1.2 N only.
#[test]
fn seconds_of_garbage_use_the_amplifiers_limits_and_keep_them() {
    for (peak_n, slew_n_per_s) in [(3.0, 400.0), (3.0, 4000.0), (8.5, 4000.0)] {
        let longest_n = |seed| {
            let strikes = vec![(0, Strike::Madman(1000), Then::Heal)];
            let plan = Plan { seed, peak_n, slew_n_per_s, strikes };
            let account = campaign::run(&plan);
            assert_eq!(account.checked, account.written, "{plan}: {account:?}");
            account.largest_force_un as f64 / 1e6
        };
        // One that turns in every tick cannot grow beyond some steps, of 2 N or of 0.2 N.
        if slew_n_per_s > 1000.0 {
            let mut longest_n = (3..11).map(longest_n);
            assert!(longest_n.any(|longest_n| longest_n > 0.5 * peak_n), "{peak_n} N, {slew_n_per_s} N/s");
        } else {
            longest_n(3);
        }
    }
}
