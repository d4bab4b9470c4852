//! The loop's thread before its first tick: set up, measured, without rights, waiting for its loop.
//!
//! Problem: scheduling, stack and capabilities are a thread's own, so that only it can set them; and what it
//! obtained decides how the driver waits, which stands in the memory that must exist before the loop does.
//! Model: the thread sets itself up, reports, and waits for orders: give up rights, run.

use crate::config::{DriverConfig, SpinMargin};
use crate::driver::RunError;
use crate::real_loop::{Ended, RealLoop, Shared};
use rt_core::calibrate;
use rt_core::histogram::Histogram;
use rt_core::privileges::{Keep, reduce_thread};
use rt_core::setup::{Guarantee, SetupGuards, SetupReport, SetupRequest};
use shm_abi::doorbell::WaitMode;
use shm_abi::segment::ClockMode;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::sync::mpsc;
use std::thread::JoinHandle;

/// Touched in advance, so that no call chain of the loop is the first to need a page of stack.
const STACK_BYTES: usize = 256 * 1024;

/// The configured CPU, else the last isolated one, else the last one, where the fewest interrupts land; none on a
/// single-CPU machine, which the application needs as well.
pub(crate) fn loop_cpu(config: &DriverConfig) -> Option<usize> {
    if config.clock != ClockMode::Real {
        return config.real_time.cpu;
    }
    let cpus = rt_core::cpu::loop_cpus();
    config.real_time.cpu.or_else(|| cpus.last().copied().filter(|_| cpus.len() > 1))
}

/// The priority that is asked for; in lockstep nothing is on time by design, so none is.
pub(crate) fn priority(config: &DriverConfig) -> Option<u8> {
    config.real_time.priority.filter(|_| config.clock == ClockMode::Real)
}

fn setup_request(config: &DriverConfig) -> SetupRequest {
    if config.clock != ClockMode::Real {
        return SetupRequest::default();
    }
    SetupRequest {
        fifo_priority: priority(config),
        cpu: loop_cpu(config),
        lock_memory: config.real_time.lock_memory,
        prefault_stack_bytes: STACK_BYTES,
        prefault_heap_bytes: 0,
        timer_slack_ns: Some(1),
        dma_latency_us: Some(0),
    }
}

/// Spinning is right only with real-time rights on one CPU of several; else it starves whom it waits for. A
/// driver that is confined to a single CPU cannot know where the application is, so it does not spin unless
/// told to.
pub(crate) fn choose_wait_mode(config: &DriverConfig, report: &SetupReport) -> WaitMode {
    if config.clock != ClockMode::Real {
        return WaitMode::Futex;
    }
    let cpu = loop_cpu(config);
    // Not by number: an isolated CPU is not among those that the process was started on.
    let leaves_a_cpu = rt_core::cpu::online_cpus().into_iter().any(|other| Some(other) != cpu);
    let owns_cpu = cpu.is_some() && leaves_a_cpu && config.real_time.priority.is_some();
    let obtained =
        ["scheduling", "cpu"].iter().all(|name| report.find(name).is_some_and(|item| item.obtained));
    config.real_time.wait.unwrap_or(if owns_cpu && obtained { WaitMode::Spin } else { WaitMode::Futex })
}

/// The loop's thread, set up and waiting for its loop.
pub(crate) struct Starter {
    send: mpsc::SyncSender<Order>,
    thread: JoinHandle<Ended>,
}

/// What the loop's thread is to do next.
enum Order {
    /// Give up its rights, which only it can, and drop the sender when that is done.
    GiveUpRights(Keep, mpsc::SyncSender<()>),
    /// Run the loop to its end.
    Run(Box<RealLoop>),
}

impl Starter {
    pub(crate) fn give_up_rights(&self, keep: Keep) {
        let (send_done, done) = mpsc::sync_channel(0);
        // Both fail only if the thread is gone, which joining it will tell.
        let _ = self.send.send(Order::GiveUpRights(keep, send_done));
        let _ = done.recv();
    }

    pub(crate) fn start(self, real_loop: RealLoop) -> JoinHandle<Ended> {
        let _ = self.send.send(Order::Run(Box::new(real_loop)));
        self.thread
    }
}

/// Starts the thread and sets it up; what is obtained must be known before the memory is described.
pub(crate) fn spawn(config: &DriverConfig, shared: &Shared) -> Result<(SetupReport, u64, Starter), RunError> {
    let request = setup_request(config);
    let (send_report, receive_report) = mpsc::sync_channel(1);
    let (send, receive) = mpsc::sync_channel::<Order>(1);
    let ended = Arc::clone(&shared.ended);
    let margin =
        if config.clock == ClockMode::Real { config.real_time.spin_margin } else { SpinMargin::Fixed(0) };
    let body = move || {
        // It reads their flag; another thread runs their handlers. If that is refused, it runs them too.
        let _ = rt_core::signals::block_in_this_thread();
        let (mut report, guards) = rt_core::setup::apply(&request);
        let spin_margin_ns = settle_spin_margin(margin, &mut report);
        let _ = send_report.send((report, spin_margin_ns));
        let end = run_when_told(&receive, guards);
        ended.store(true, Ordering::Release);
        end
    };
    let thread = std::thread::Builder::new()
        .name("driver-loop".into())
        .spawn(body)
        .map_err(|source| RunError::NoThread { what: "start the loop", source })?;
    let (report, spin_margin_ns) =
        receive_report.recv().map_err(|_| RunError::Panicked("during its set-up".into()))?;
    Ok((report, spin_margin_ns, Starter { send, thread }))
}

/// Measures on the thread that calls, which has to be set up as it will run.
fn settle_spin_margin(margin: SpinMargin, report: &mut SetupReport) -> u64 {
    match margin {
        SpinMargin::Fixed(ns) => ns,
        SpinMargin::Calibrated { at_most_ns } => {
            let lateness = calibrate::sleep_lateness(calibrate::SLEEPS);
            let chosen = calibrate::spin_margin_ns(&lateness, at_most_ns);
            report.guarantees.push(judge_spin_margin(&lateness, chosen));
            chosen
        }
    }
}

fn judge_spin_margin(lateness: &Histogram, chosen_ns: u64) -> Guarantee {
    let us = |ns: u64| ns as f64 / 1e3;
    let wanted_ns = calibrate::wanted_margin_ns(lateness);
    let p99 = lateness.percentile(0.99).unwrap_or(0);
    let remedy = (wanted_ns > chosen_ns).then(|| {
        "sleeps end later than spinning can make up for; `io-driver doctor` looks for the cause".to_owned()
    });
    Guarantee::circumstance(
        "spin margin",
        "what late sleeps need",
        format!("{:.0} us; 99 of 100 sleeps end within {:.0} us", us(chosen_ns), us(p99)),
        remedy,
    )
}

/// The guards are kept as long as the loop runs.
fn run_when_told(receive: &mpsc::Receiver<Order>, _guards: SetupGuards) -> Ended {
    loop {
        match receive.recv() {
            Ok(Order::GiveUpRights(keep, _done)) => reduce_thread(keep),
            Ok(Order::Run(real_loop)) => return real_loop.run(),
            // The start failed elsewhere, which was told there.
            Err(_) => return Ended::Stopped,
        }
    }
}
