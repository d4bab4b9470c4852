//! The lock-free protocol under all interleavings and all reorderings that the memory model allows.
//!
//! The functions under test are the production ones: `seqlock` and `doorbell` are generic over the word,
//! and here the word is loom's. Next to each claim stands a weakened copy of the code that breaks it, so
//! that a model which can no longer fail is noticed.
//!
//! The models are as small as the claim allows (two payload words are enough to be mixed, two slots to be
//! lapped), so that the search is complete: no bound on preemptions.

use loom::sync::atomic::{AtomicU64, fence};
use loom::sync::{Arc, Mutex};
use loom::thread;
use shm_abi::doorbell::{announce, newest, raise_flag, sleeper};
use shm_abi::layout::{SLEEPS_ON_OTHERS_BELL, SLEEPS_ON_OWN_WORD};
use shm_abi::seqlock::{self, Torn, Word, stamp};
use std::sync::atomic::{AtomicUsize, Ordering};

const SLOTS: usize = 2;

#[derive(Default)]
struct LoomWord(AtomicU64);

impl Word for LoomWord {
    fn load(&self, order: Ordering) -> u64 {
        self.0.load(order)
    }
    fn store(&self, value: u64, order: Ordering) {
        self.0.store(value, order);
    }
    fn fence(order: Ordering) {
        fence(order);
    }
}

#[derive(Default)]
struct Slot<W> {
    sequence: W,
    words: [W; 2],
}

impl<W: Word> Slot<W> {
    fn write(&self, k: u64) {
        seqlock::write(&self.sequence, &self.words, &payload(k), k);
    }

    /// Reads the slot, and does not let a mixed value pass.
    fn read(&self) -> Result<u64, Torn> {
        let mut found = [0; 2];
        let stamp = seqlock::read(&self.sequence, &self.words, &mut found)?;
        if stamp != 0 {
            assert_eq!(found, payload((stamp - 2) / 2), "mixed value under stamp {stamp}");
        }
        Ok(stamp)
    }
}

/// Words of value `k` that occur in no other value.
fn payload(k: u64) -> [u64; 2] {
    [10 * k + 1, 10 * k + 2]
}

#[derive(Default)]
struct Ring {
    slots: [Slot<LoomWord>; SLOTS],
    latest_plus_one: LoomWord,
}

impl Ring {
    fn slot(&self, k: u64) -> &Slot<LoomWord> {
        &self.slots[k as usize % SLOTS]
    }

    fn publish(&self, k: u64) {
        self.slot(k).write(k);
        announce(&self.latest_plus_one, k);
    }
}

/// Runs `model` and says in how many executions the thing worth modelling happened: a claim about something
/// that never happens proves nothing.
fn explore_counting(model: impl Fn(&AtomicUsize) + Send + Sync + 'static) -> usize {
    // A std counter on purpose: it is outside of the model.
    let count = std::sync::Arc::new(AtomicUsize::new(0));
    let inner = count.clone();
    loom::model(move || model(&inner));
    count.load(Ordering::Relaxed)
}

#[test]
fn a_reader_of_a_ring_of_two_sees_whole_values_under_their_own_stamp() {
    const VALUES: u64 = 4;
    // Two laps: the reader is overtaken inside a read, by a whole lap and by half of one.
    let read_whole = explore_counting(|read_whole| {
        let ring = Arc::new(Ring::default());
        let writer = {
            let ring = ring.clone();
            thread::spawn(move || (0..VALUES).for_each(|k| ring.publish(k)))
        };
        if let Some(k) = newest(&ring.latest_plus_one) {
            match ring.slot(k).read() {
                Ok(found) => {
                    // Its own value or the one of the next lap, never an older one: k was announced.
                    assert!(found == stamp(k) || found == stamp(k + SLOTS as u64), "{found} for value {k}");
                    read_whole.fetch_add(1, Ordering::Relaxed);
                }
                Err(Torn) => assert!(k + (SLOTS as u64) < VALUES, "value {k} is never overwritten"),
            }
        }
        writer.join().unwrap();
    });
    assert!(read_whole > 0);
}

#[test]
fn an_announced_value_that_nobody_overwrites_is_always_readable() {
    let read_whole = explore_counting(|read_whole| {
        let ring = Arc::new(Ring::default());
        let writer = {
            let ring = ring.clone();
            thread::spawn(move || (0..SLOTS as u64).for_each(|k| ring.publish(k)))
        };
        if let Some(k) = newest(&ring.latest_plus_one) {
            assert_eq!(ring.slot(k).read(), Ok(stamp(k)));
            read_whole.fetch_add(1, Ordering::Relaxed);
        }
        writer.join().unwrap();
    });
    assert!(read_whole > 0);
}

#[test]
fn the_reply_that_the_driver_finds_announced_is_whole_and_answers_its_tick() {
    const TICK: u64 = 6;
    let exchanged = explore_counting(|exchanged| {
        let frames = Arc::new(Ring::default());
        let commands = Arc::new(Ring::default());
        let commander = {
            let (frames, commands) = (frames.clone(), commands.clone());
            thread::spawn(move || {
                if let Some(tick) = newest(&frames.latest_plus_one) {
                    assert_eq!(frames.slot(tick).read(), Ok(stamp(TICK)));
                    commands.publish(tick);
                }
            })
        };
        frames.publish(TICK);
        if let Some(tick) = newest(&commands.latest_plus_one) {
            assert_eq!(tick, TICK);
            assert_eq!(commands.slot(tick).read(), Ok(stamp(TICK)));
            exchanged.fetch_add(1, Ordering::Relaxed);
        }
        commander.join().unwrap();
    });
    assert!(exchanged > 0);
}

/// As `DriverMemory::write_frame` does where not all devices exist: the end of the slot is never written, and a
/// reader takes only the beginning, or, being older, the whole slot.
#[test]
fn a_value_that_fills_only_the_beginning_of_its_slot_is_read_whole_by_short_and_long_readers() {
    const USED: usize = 2;
    let read_whole = explore_counting(|read_whole| {
        let slot: Arc<(LoomWord, [LoomWord; USED + 1])> = Arc::default();
        let write = |slot: &(LoomWord, [LoomWord; USED + 1]), k| {
            seqlock::write(&slot.0, &slot.1[..USED], &payload(k), k);
        };
        write(&slot, 0);
        let writer = {
            let slot = slot.clone();
            thread::spawn(move || write(&slot, 1))
        };
        let mut short = [0; USED];
        if let Ok(found) = seqlock::read(&slot.0, &slot.1[..USED], &mut short) {
            assert_eq!(short, payload((found - 2) / 2), "mixed value");
            read_whole.fetch_add(1, Ordering::Relaxed);
        }
        let mut long = [u64::MAX; USED + 1];
        if let Ok(found) = seqlock::read(&slot.0, &slot.1, &mut long) {
            let [first, second] = payload((found - 2) / 2);
            assert_eq!(long, [first, second, 0], "mixed value, or a stranger behind it");
        }
        writer.join().unwrap();
    });
    assert!(read_whole > 0);
}

/// A word whose writer dies: after so many stores, the rest never happen.
#[derive(Default)]
struct MortalWord {
    word: LoomWord,
    stores_left: std::sync::Arc<AtomicUsize>,
}

impl Word for MortalWord {
    fn load(&self, order: Ordering) -> u64 {
        self.word.load(order)
    }
    fn store(&self, value: u64, order: Ordering) {
        let spend = |left: usize| left.checked_sub(1);
        if self.stores_left.fetch_update(Ordering::Relaxed, Ordering::Relaxed, spend).is_ok() {
            self.word.store(value, order);
        }
    }
    fn fence(order: Ordering) {
        LoomWord::fence(order);
    }
}

#[test]
fn a_writer_that_stops_inside_a_write_leaves_a_slot_that_reads_as_torn() {
    /// Sequence, two words, sequence.
    const STORES_OF_A_WRITE: usize = 4;
    const FIRST: u64 = 0;
    const SECOND: u64 = 2;
    for stores in 0..=STORES_OF_A_WRITE {
        loom::model(move || {
            let left = std::sync::Arc::new(AtomicUsize::new(STORES_OF_A_WRITE + stores));
            let word = || MortalWord { word: LoomWord::default(), stores_left: left.clone() };
            let slot = Arc::new(Slot { sequence: word(), words: [word(), word()] });
            slot.write(FIRST);
            let writer = {
                let slot = slot.clone();
                thread::spawn(move || slot.write(SECOND))
            };
            let _ = slot.read();
            writer.join().unwrap();
            let expected = match stores {
                0 => Ok(stamp(FIRST)),
                STORES_OF_A_WRITE => Ok(stamp(SECOND)),
                _ => Err(Torn),
            };
            assert_eq!(slot.read(), expected, "after {stores} stores");
        });
    }
}

/// What sleeping means in the kernel: the word is compared and the sleeper enqueued in one step. Nobody
/// really sleeps here; whoever is still enqueued in the end would have slept for ever.
#[derive(Default)]
struct Futex {
    enqueued: Mutex<bool>,
}

impl Futex {
    fn wait(&self, word: &LoomWord, expected: u64) {
        let mut enqueued = self.enqueued.lock().unwrap();
        *enqueued = word.load(Ordering::Relaxed) == expected;
    }

    fn wake(&self) {
        *self.enqueued.lock().unwrap() = false;
    }

    fn assert_nobody_sleeps_on(&self) {
        assert!(!*self.enqueued.lock().unwrap(), "the wake-up was lost");
    }
}

#[derive(Default)]
struct Bell {
    latest_plus_one: LoomWord,
    /// The word that is slept on: the bell's own, or one of the sleeper's segment.
    doorbell: LoomWord,
    reader_sleeps: LoomWord,
    futex: Futex,
}

impl Bell {
    /// The order of steps is that of `doorbell::tell_frame` and `wake_sleeper` for a commander that sleeps on its own word.
    fn ring_own_word(&self, k: u64) {
        announce(&self.latest_plus_one, k);
        if sleeper(&self.reader_sleeps) == SLEEPS_ON_OWN_WORD {
            self.doorbell.store(k + 1, Ordering::Release);
            self.futex.wake();
        }
    }

    /// The order of steps is that of `doorbell::sleep`; the flag stays up. Returns whether the last look found
    /// nothing new.
    fn sleep_on_own_word(&self, seen: Option<u64>) -> bool {
        let expected = self.doorbell.load(Ordering::Acquire);
        raise_flag(&self.reader_sleeps, SLEEPS_ON_OWN_WORD);
        let sleeps = newest(&self.latest_plus_one) == seen;
        if sleeps {
            self.futex.wait(&self.doorbell, expected);
        }
        sleeps
    }
}

#[test]
fn a_sleeper_that_saw_the_old_number_is_always_seen_by_the_publisher() {
    let slept = explore_counting(|slept| {
        let bell = Arc::new(Bell::default());
        let publisher = {
            let bell = bell.clone();
            thread::spawn(move || {
                announce(&bell.latest_plus_one, 0);
                sleeper(&bell.reader_sleeps) != 0
            })
        };
        raise_flag(&bell.reader_sleeps, SLEEPS_ON_OTHERS_BELL);
        let sleeps = newest(&bell.latest_plus_one).is_none();
        let wakes = publisher.join().unwrap();
        assert!(wakes || !sleeps, "each missed the other");
        slept.fetch_add(usize::from(sleeps), Ordering::Relaxed);
    });
    assert!(slept > 0);
}

#[test]
fn no_wake_up_is_lost_between_ring_and_sleep() {
    // The order of steps is that of `doorbell::ring` and `doorbell::sleep`.
    loom::model(|| {
        let bell = Arc::new(Bell::default());
        let publisher = {
            let bell = bell.clone();
            thread::spawn(move || {
                announce(&bell.latest_plus_one, 0);
                bell.doorbell.store(1, Ordering::Release);
                if sleeper(&bell.reader_sleeps) != 0 {
                    bell.futex.wake();
                }
            })
        };
        let expected = bell.doorbell.load(Ordering::Acquire);
        raise_flag(&bell.reader_sleeps, SLEEPS_ON_OTHERS_BELL);
        if newest(&bell.latest_plus_one).is_none() {
            bell.futex.wait(&bell.doorbell, expected);
        }
        publisher.join().unwrap();
        bell.futex.assert_nobody_sleeps_on();
    });
}

#[test]
fn no_wake_up_is_lost_on_a_word_that_changes_only_while_somebody_sleeps_on_it() {
    let slept = explore_counting(|slept| {
        let bell = Arc::new(Bell::default());
        let publisher = {
            let bell = bell.clone();
            thread::spawn(move || bell.ring_own_word(0))
        };
        slept.fetch_add(usize::from(bell.sleep_on_own_word(None)), Ordering::Relaxed);
        publisher.join().unwrap();
        bell.futex.assert_nobody_sleeps_on();
    });
    assert!(slept > 0);
}

/// A publisher that saw the flag of a former sleep changes the word late, in the middle of the next one.
#[test]
fn no_wake_up_is_lost_where_one_sleep_follows_another() {
    const LAST: u64 = 1;
    let slept = explore_counting(|slept| {
        let bell = Arc::new(Bell::default());
        raise_flag(&bell.reader_sleeps, SLEEPS_ON_OWN_WORD);
        let publisher = {
            let bell = bell.clone();
            thread::spawn(move || (0..=LAST).for_each(|k| bell.ring_own_word(k)))
        };
        bell.reader_sleeps.store(0, Ordering::Relaxed);
        let seen = newest(&bell.latest_plus_one);
        slept.fetch_add(usize::from(bell.sleep_on_own_word(seen)), Ordering::Relaxed);
        publisher.join().unwrap();
        if seen != Some(LAST) {
            bell.futex.assert_nobody_sleeps_on();
        }
    });
    assert!(slept > 0);
}

// What follows is broken on purpose: each weakening must be caught, or the models above check nothing.

/// [`seqlock::write`] and [`seqlock::read`] against each other with one of the two fences left out.
fn explore_without(release_fence: bool, acquire_fence: bool) {
    loom::model(move || {
        let slot = Arc::new(Slot::<LoomWord>::default());
        slot.write(0);
        let writer = {
            let slot = slot.clone();
            thread::spawn(move || {
                slot.sequence.store(stamp(1) - 1, Ordering::Relaxed);
                if release_fence {
                    fence(Ordering::Release);
                }
                for (word, value) in slot.words.iter().zip(payload(1)) {
                    word.store(value, Ordering::Relaxed);
                }
                slot.sequence.store(stamp(1), Ordering::Release);
            })
        };
        let before = slot.sequence.load(Ordering::Acquire);
        let found = [slot.words[0].load(Ordering::Relaxed), slot.words[1].load(Ordering::Relaxed)];
        if acquire_fence {
            fence(Ordering::Acquire);
        }
        let after = slot.sequence.load(Ordering::Relaxed);
        if before & 1 == 0 && before == after {
            assert_eq!(found, payload((before - 2) / 2), "mixed value");
        }
        writer.join().unwrap();
    });
}

#[test]
fn the_spelt_out_copy_of_the_seqlock_holds_with_both_fences() {
    explore_without(true, true);
}

#[test]
#[should_panic(expected = "mixed value")]
fn a_write_without_its_release_fence_is_caught() {
    explore_without(false, true);
}

#[test]
#[should_panic(expected = "mixed value")]
fn a_read_without_its_acquire_fence_is_caught() {
    explore_without(true, false);
}

#[test]
#[should_panic(expected = "never announced unwritten")]
fn an_announcement_before_the_value_is_caught() {
    loom::model(|| {
        let ring = Arc::new(Ring::default());
        let writer = {
            let ring = ring.clone();
            thread::spawn(move || {
                announce(&ring.latest_plus_one, 0);
                ring.slot(0).write(0);
            })
        };
        if let Some(k) = newest(&ring.latest_plus_one) {
            assert_eq!(ring.slot(k).read(), Ok(stamp(k)), "never announced unwritten");
        }
        writer.join().unwrap();
    });
}

#[test]
#[should_panic(expected = "each missed the other")]
fn a_handshake_without_its_fences_is_caught() {
    loom::model(|| {
        let bell = Arc::new(Bell::default());
        let publisher = {
            let bell = bell.clone();
            thread::spawn(move || {
                announce(&bell.latest_plus_one, 0);
                bell.reader_sleeps.load(Ordering::Relaxed) != 0
            })
        };
        bell.reader_sleeps.store(1, Ordering::Relaxed);
        let sleeps = newest(&bell.latest_plus_one).is_none();
        let wakes = publisher.join().unwrap();
        assert!(wakes || !sleeps, "each missed the other");
    });
}

#[test]
#[should_panic(expected = "the wake-up was lost")]
fn a_flag_that_goes_up_after_the_last_look_is_caught() {
    loom::model(|| {
        let bell = Arc::new(Bell::default());
        let publisher = {
            let bell = bell.clone();
            thread::spawn(move || {
                announce(&bell.latest_plus_one, 0);
                // The doorbell moves too late to stop the sleeper, too.
                if sleeper(&bell.reader_sleeps) != 0 {
                    bell.futex.wake();
                }
                bell.doorbell.store(1, Ordering::Release);
            })
        };
        let expected = bell.doorbell.load(Ordering::Acquire);
        if newest(&bell.latest_plus_one).is_none() {
            raise_flag(&bell.reader_sleeps, SLEEPS_ON_OTHERS_BELL);
            bell.futex.wait(&bell.doorbell, expected);
        }
        publisher.join().unwrap();
        bell.futex.assert_nobody_sleeps_on();
    });
}

#[test]
#[should_panic(expected = "the wake-up was lost")]
fn an_own_word_that_changes_only_after_the_wake_up_is_caught() {
    loom::model(|| {
        let bell = Arc::new(Bell::default());
        let publisher = {
            let bell = bell.clone();
            thread::spawn(move || {
                announce(&bell.latest_plus_one, 0);
                if sleeper(&bell.reader_sleeps) == SLEEPS_ON_OWN_WORD {
                    bell.futex.wake();
                    bell.doorbell.store(1, Ordering::Release);
                }
            })
        };
        bell.sleep_on_own_word(None);
        publisher.join().unwrap();
        bell.futex.assert_nobody_sleeps_on();
    });
}
