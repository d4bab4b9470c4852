//! Cost to the driver's loop of waking the commander while observers crowd the doorbell that all share.
//!
//! Run `cargo bench -p shm-abi --bench wake`. `everybody` is the way of before 1.3, still in force from the commander
//! to the driver: whoever sleeps on the shared bell is woken. `own word` is today's. Both take turns within one run; the
//! figures are the time that the ring itself takes.

use rustix::thread::futex;
use shm_abi::doorbell;
use shm_abi::layout::SLEEPS_ON_OTHERS_BELL;
use shm_abi::segment::{ClockMode, DriverInfo};
use shm_abi::{CommanderMemory, CommanderView, DriverMemory, DriverView};
use std::os::fd::AsFd;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, Instant};

const CROWDS: [usize; 3] = [0, 60, 1000];
const ROUNDS: u64 = 100;
/// Longer than anybody needs to fall asleep again.
const REST: Duration = Duration::from_millis(20);

fn main() {
    for crowd in CROWDS {
        let [everybody, own_word] = measure(crowd).map(|mut times| {
            times.sort_unstable();
            (times[times.len() / 2], times[times.len() - 1])
        });
        println!(
            "{crowd:4} observers asleep: everybody median {:7} ns, max {:8} ns; own word median {:6} ns, max {:7} ns",
            everybody.0, everybody.1, own_word.0, own_word.1
        );
    }
}

fn measure(crowd: usize) -> [Vec<u128>; 2] {
    let memory = DriverMemory::create(&info()).expect("memory");
    let driver = DriverView::map(memory.fd()).expect("a view");
    let (view, fd) = CommanderView::create(1).expect("a lease");
    let commander = CommanderMemory::map(fd.as_fd()).expect("its memory");
    let done = AtomicBool::new(false);
    let mut times: [Vec<u128>; 2] = Default::default();
    std::thread::scope(|scope| {
        for _ in 0..crowd {
            let asleep = || {
                let word = &driver.bell.doorbell;
                while !done.load(Ordering::Relaxed) {
                    let _ = futex::wait(word, futex::Flags::empty(), word.load(Ordering::Relaxed), None);
                }
            };
            std::thread::Builder::new().stack_size(64 << 10).spawn_scoped(scope, asleep).expect("a thread");
        }
        scope.spawn(|| {
            while !done.load(Ordering::Relaxed) {
                driver.sleep_for_frame(driver.latest_tick(), &commander, Duration::from_secs(1));
            }
        });
        let old = AtomicU64::new(SLEEPS_ON_OTHERS_BELL);
        for tick in 0..ROUNDS {
            std::thread::sleep(REST);
            let begun = Instant::now();
            if tick % 2 == 0 {
                doorbell::ring(&memory.bell, tick, &old);
            } else {
                memory.ring(tick, Some(&view));
            }
            times[(tick % 2) as usize].push(begun.elapsed().as_nanos());
        }
        done.store(true, Ordering::Relaxed);
        // New numbers, so that nobody falls asleep on an old one.
        memory.ring(ROUNDS, Some(&view));
        doorbell::wake(&memory.bell);
    });
    times
}

fn info() -> DriverInfo {
    DriverInfo {
        period_ns: 1_000_000,
        reply_budget_ns: 300_000,
        max_command_age_ticks: 5,
        ramp_in_ticks: 200,
        ramp_out_ticks: 50,
        is_commissioning: false,
        clock_mode: ClockMode::Virtual,
        wait_mode: doorbell::WaitMode::Futex,
        cpu: None,
        devices: Vec::new(),
        setup_report: String::new(),
    }
}
