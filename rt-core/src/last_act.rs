//! The last act: what a dying process still stores to the hardware, and that nobody undoes it.
//!
//! Problem: a thread that hits a fatal signal or a forbidden system call may not be the one that writes the
//! motors, and the one that does may be on another CPU in the middle of a write. Zeroing in the handler alone
//! leaves a window in which the writer stores a force after the zero.
//! Model: whoever maps hardware registers [`guard`]s those that switch it off, with the value that does.
//! [`perform`] says that it has begun and then stores them all. The writer asks [`has_begun`] before it
//! stores a value and again after: before, it stores nothing any more; after, it stores the safe values once
//! more ([`store_unless_dying`]). Between its stores and that second look stands a full fence. Whichever way the
//! two interleave, the safe values are stored last.
//! A register that cannot be reached any more (its card is gone, its file was cut) would end the last act at its store:
//! what a fault says of an address is [noted](give_up), and the others are stored.
//! Invariants: [`perform`], [`give_up`] and [`has_begun`] are async-signal-safe; a guarded register stays guarded.
//! Cost: two loads and a fence (some 10 ns) for the writer; as many stores as there are registers for the last act.

use std::sync::atomic::{AtomicBool, AtomicPtr, AtomicU32, AtomicUsize, Ordering, fence};
use thiserror::Error;

/// Registers that can be guarded in one process: eight devices with eight each.
pub const MAX_REGISTERS: usize = 64;

/// There is no room for another register.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
#[error("no more than {MAX_REGISTERS} registers can be switched off by a dying process")]
pub struct NoRoom;

/// Stores `safe` to `register` when the process dies.
///
/// # Errors
/// If all places are taken.
pub fn guard(register: &'static AtomicU32, safe: u32) -> Result<(), NoRoom> {
    LAST_ACT.guard(register, safe)
}

/// Stores the safe values. For handlers of fatal signals; as often as they like.
pub fn perform() {
    LAST_ACT.perform();
}

/// The memory about this address cannot be reached: registers in its page are stored no more.
pub fn give_up(address: usize) {
    LAST_ACT.give_up(address);
}

/// Whether the process is dying, so that nothing but safe values may be stored.
#[inline]
pub fn has_begun() -> bool {
    LAST_ACT.begun.load(Ordering::SeqCst)
}

/// Stores values to hardware unless the process is dying: `store` is called at most once, and if the last act
/// began meanwhile the safe values follow it.
#[inline]
pub fn store_unless_dying(store: impl FnOnce()) {
    LAST_ACT.store_unless_begun(store);
}

static LAST_ACT: LastAct = LastAct::new();

/// The registers and whether it has begun.
struct LastAct {
    begun: AtomicBool,
    taken: AtomicUsize,
    registers: [AtomicPtr<AtomicU32>; MAX_REGISTERS],
    safe: [AtomicU32; MAX_REGISTERS],
    gone: [AtomicBool; MAX_REGISTERS],
}

/// Size of the smallest page (bytes): memory comes and goes by pages, and a fault's address tells of one.
const PAGE: usize = 4096;

impl LastAct {
    const fn new() -> Self {
        Self {
            begun: AtomicBool::new(false),
            taken: AtomicUsize::new(0),
            registers: [const { AtomicPtr::new(std::ptr::null_mut()) }; MAX_REGISTERS],
            safe: [const { AtomicU32::new(0) }; MAX_REGISTERS],
            gone: [const { AtomicBool::new(false) }; MAX_REGISTERS],
        }
    }

    fn guard(&self, register: &'static AtomicU32, safe: u32) -> Result<(), NoRoom> {
        let place = self.taken.fetch_add(1, Ordering::SeqCst);
        if place >= MAX_REGISTERS {
            self.taken.store(MAX_REGISTERS, Ordering::SeqCst);
            return Err(NoRoom);
        }
        self.safe[place].store(safe, Ordering::SeqCst);
        // Last, so that a handler in between finds the value that belongs to it.
        self.registers[place].store(std::ptr::from_ref(register).cast_mut(), Ordering::SeqCst);
        Ok(())
    }

    fn perform(&self) {
        self.begun.store(true, Ordering::SeqCst);
        for ((register, safe), gone) in self.registers.iter().zip(&self.safe).zip(&self.gone) {
            if gone.load(Ordering::SeqCst) {
                continue;
            }
            if let Some(register) = crate::sys::static_register(register) {
                register.store(safe.load(Ordering::SeqCst), Ordering::SeqCst);
            }
        }
    }

    fn give_up(&self, address: usize) {
        for (register, gone) in self.registers.iter().zip(&self.gone) {
            let register = register.load(Ordering::SeqCst);
            if !register.is_null() && register.addr() / PAGE == address / PAGE {
                gone.store(true, Ordering::SeqCst);
            }
        }
    }

    fn store_unless_begun(&self, store: impl FnOnce()) {
        if self.begun.load(Ordering::SeqCst) {
            return;
        }
        store();
        // A plain store may wait in the CPU while a later load overtakes it: the dying thread would store the safe
        // values in between, and this one would follow them. The fence lets it arrive first.
        fence(Ordering::SeqCst);
        if self.begun.load(Ordering::SeqCst) {
            self.perform();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn leak(value: u32) -> &'static AtomicU32 {
        Box::leak(Box::new(AtomicU32::new(value)))
    }

    #[test]
    fn the_last_act_stores_each_registers_own_safe_value() {
        let act = LastAct::new();
        let (motor, enable) = (leak(3000), leak(1));
        act.guard(motor, 2048).unwrap();
        act.guard(enable, 0).unwrap();
        act.perform();
        assert_eq!((motor.load(Ordering::SeqCst), enable.load(Ordering::SeqCst)), (2048, 0));
    }

    #[test]
    fn a_dying_process_stores_no_force_any_more() {
        let act = LastAct::new();
        let motor = leak(2048);
        act.guard(motor, 2048).unwrap();
        act.store_unless_begun(|| motor.store(2100, Ordering::SeqCst));
        assert_eq!(motor.load(Ordering::SeqCst), 2100);
        act.perform();
        act.store_unless_begun(|| motor.store(2200, Ordering::SeqCst));
        assert_eq!(motor.load(Ordering::SeqCst), 2048);
    }

    #[test]
    fn a_store_that_the_last_act_overtakes_is_undone() {
        let act = LastAct::new();
        let motor = leak(2048);
        act.guard(motor, 2048).unwrap();
        act.store_unless_begun(|| {
            act.perform();
            motor.store(2300, Ordering::SeqCst);
        });
        assert_eq!(motor.load(Ordering::SeqCst), 2048);
    }

    #[test]
    fn writers_and_a_dying_thread_leave_the_safe_value_however_they_meet() {
        for _ in 0..2000 {
            let act = LastAct::new();
            let motor = leak(2048);
            act.guard(motor, 2048).unwrap();
            std::thread::scope(|scope| {
                scope.spawn(|| act.perform());
                for force in 2100..2140 {
                    act.store_unless_begun(|| motor.store(force, Ordering::SeqCst));
                }
            });
            assert_eq!(motor.load(Ordering::SeqCst), 2048);
        }
    }

    /// Plain stores, as devices make them: they may still be on their way in the writer's CPU when it looks
    /// whether the last act has begun. The moment counts in nanoseconds, so both meet at the same word each time,
    /// one or the other a little later.
    #[test]
    fn a_plain_store_that_is_still_on_its_way_does_not_follow_the_safe_value() {
        const ROUNDS: u32 = 20_000;
        let acts: Vec<(LastAct, &AtomicU32)> = (0..ROUNDS).map(|_| (LastAct::new(), leak(2048))).collect();
        let arrived = AtomicU32::new(0);
        let meet = |round: u32, delay: u32| {
            arrived.fetch_add(1, Ordering::SeqCst);
            let mut spins = 0;
            while arrived.load(Ordering::SeqCst) < 2 * (round + 1) {
                spins += 1;
                // Where the other thread has no CPU of its own it gets ours.
                if spins % 10_000 == 0 { std::thread::yield_now() } else { std::hint::spin_loop() }
            }
            (0..delay).for_each(|_| std::hint::spin_loop());
        };
        let dying = || {
            for (round, (act, motor)) in (0..).zip(&acts) {
                // The register's line is here when the writer stores to it.
                act.guard(motor, 2048).unwrap();
                motor.store(2048, Ordering::SeqCst);
                meet(round, round % 7);
                act.perform();
            }
        };
        let writing = || {
            for (round, (act, motor)) in (0..).zip(&acts) {
                meet(round, round % 11);
                act.store_unless_begun(|| motor.store(2300, Ordering::Relaxed));
            }
        };
        // A thread that fails leaves the other to wait.
        patience::watched(patience::limit(), "the two threads", || {
            std::thread::scope(|scope| {
                scope.spawn(dying);
                writing();
            });
        });
        let undone = acts.iter().filter(|(_, motor)| motor.load(Ordering::SeqCst) != 2048).count();
        assert_eq!(undone, 0, "of {ROUNDS} last acts were undone");
    }

    #[test]
    fn too_many_registers_are_refused() {
        let act = LastAct::new();
        for _ in 0..MAX_REGISTERS {
            act.guard(leak(0), 0).unwrap();
        }
        assert_eq!(act.guard(leak(0), 0), Err(NoRoom));
        assert_eq!(act.guard(leak(0), 0), Err(NoRoom), "and again");
    }
}
