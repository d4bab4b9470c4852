//! What happened, and when: beside the rows, for people and for tools that look for moments.
//!
//! Model: an [`Event`] is a kind, a tick, and what it is about. Whoever has some hands them to an [`EventSink`]; a
//! recording is one. [`ContactWatch`] finds in the rows what can be found there: contacts that begin and end, slip that
//! begins and ends, objects that are tied and let go.

use crate::columns::Names;
use crate::row::{FingerRow, Row};
use haptics::ContactState;

/// What kind of thing happened; its word is what a recording has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum EventKind {
    /// A finger touches an entity; the value is the force (N).
    ContactBegin,
    /// It does not any more; the value is how long it did (s).
    ContactEnd,
    /// It begins to slip; the value is the force (N).
    SlipBegin,
    /// It holds again; the value is how long it slipped (s).
    SlipEnd,
    /// An object is tied to a finger.
    Attached,
    /// It is let go.
    Released,
    /// So many rows before this one (the value) are missing: whoever records was too slow.
    RowsLost,
}

impl EventKind {
    /// Its word.
    pub fn name(self) -> &'static str {
        match self {
            Self::ContactBegin => "contact-begin",
            Self::ContactEnd => "contact-end",
            Self::SlipBegin => "slip-begin",
            Self::SlipEnd => "slip-end",
            Self::Attached => "attached",
            Self::Released => "released",
            Self::RowsLost => "rows-lost",
        }
    }
}

/// Something that happened.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Event<'a> {
    /// What.
    pub kind: EventKind,
    /// In which tick of the run.
    pub run_tick: u64,
    /// To which finger; empty if to none.
    pub finger: &'a str,
    /// With which entity; empty if with none.
    pub entity: &'a str,
    /// How much, by its kind.
    pub value: f64,
    /// In words, if it needs any.
    pub text: &'a str,
}

/// Whoever wants to know.
pub trait EventSink {
    /// Takes note of one; events come in the order of their ticks.
    fn event(&mut self, event: &Event<'_>);
}

/// Finds the events in rows.
#[derive(Debug)]
pub struct ContactWatch {
    fingers: Vec<Watched>,
    period_s: f64,
}

/// What a finger did in the row before.
#[derive(Debug, Clone, Copy, Default)]
struct Watched {
    entity: Option<u32>,
    began: u64,
    slips: bool,
    slip_began: u64,
    attached: Option<u32>,
}

impl ContactWatch {
    /// Of so many fingers, which touch nothing yet.
    pub fn new(fingers: usize, period_ns: u64) -> Self {
        Self { fingers: vec![Watched::default(); fingers], period_s: period_ns as f64 / 1e9 }
    }

    /// Tells what is new in a row.
    pub fn look(&mut self, row: &Row, names: &Names, sink: &mut impl EventSink) {
        let period_s = self.period_s;
        let all = self.fingers.iter_mut().zip(&row.fingers).zip(&names.fingers);
        for ((watched, finger_row), finger) in all {
            let duration_s = |began: u64| (row.run_tick - began.min(row.run_tick)) as f64 * period_s;
            let mut tell = |kind: EventKind, entity: Option<u32>, value: f64| {
                let entity = names.entity(entity);
                sink.event(&Event { kind, run_tick: row.run_tick, finger, entity, value, text: "" });
            };
            watched.step(finger_row, row.run_tick, duration_s, &mut tell);
        }
    }
}

impl Watched {
    fn step(
        &mut self,
        row: &FingerRow,
        now: u64,
        duration_s: impl Fn(u64) -> f64,
        tell: &mut impl FnMut(EventKind, Option<u32>, f64),
    ) {
        let changed = row.entity != self.entity;
        let slips = row.entity.is_some() && row.friction == ContactState::Slip;
        if self.slips && (changed || !slips) {
            tell(EventKind::SlipEnd, self.entity, duration_s(self.slip_began));
            self.slips = false;
        }
        if changed {
            if self.entity.is_some() {
                tell(EventKind::ContactEnd, self.entity, duration_s(self.began));
            }
            if row.entity.is_some() {
                tell(EventKind::ContactBegin, row.entity, row.force_on_user.norm());
            }
            (self.entity, self.began) = (row.entity, now);
        }
        if slips && !self.slips {
            tell(EventKind::SlipBegin, row.entity, row.force_on_user.norm());
            (self.slips, self.slip_began) = (true, now);
        }
        if row.attached != self.attached {
            if self.attached.is_some() {
                tell(EventKind::Released, self.attached, 0.0);
            }
            if row.attached.is_some() {
                tell(EventKind::Attached, row.attached, 0.0);
            }
            self.attached = row.attached;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;

    struct Words(Vec<String>);

    impl EventSink for Words {
        fn event(&mut self, event: &Event<'_>) {
            let Event { kind, run_tick, finger, entity, value, .. } = event;
            self.0.push(format!("{run_tick} {finger} {} {entity} {value:.3}", kind.name()));
        }
    }

    #[test]
    fn contacts_and_slips_begin_and_end_in_order() {
        let names = Names {
            fingers: vec!["f0".into()],
            entities: vec!["table".into(), "ball".into()],
            ..Names::default()
        };
        let mut watch = ContactWatch::new(1, 1_000_000);
        let mut words = Words(Vec::new());
        let (stick, slip) = (ContactState::Stick, ContactState::Slip);
        let ticks = [
            (0, None, ContactState::Free),
            (1, Some(0), stick),
            (2, Some(0), slip),
            (5, Some(0), stick),
            (6, Some(0), slip),
            (7, Some(1), slip),
            (9, None, ContactState::Free),
        ];
        for (run_tick, entity, friction) in ticks {
            let mut row = Row { run_tick, ..Row::empty() };
            row.fingers[0].entity = entity;
            row.fingers[0].friction = friction;
            row.fingers[0].force_on_user = Vector3::new(0.0, 2.0, 0.0);
            watch.look(&row, &names, &mut words);
        }
        assert_eq!(
            words.0,
            [
                "1 f0 contact-begin table 2.000",
                "2 f0 slip-begin table 2.000",
                "5 f0 slip-end table 0.003",
                "6 f0 slip-begin table 2.000",
                "7 f0 slip-end table 0.001",
                "7 f0 contact-end table 0.006",
                "7 f0 contact-begin ball 2.000",
                "7 f0 slip-begin ball 2.000",
                "9 f0 slip-end ball 0.002",
                "9 f0 contact-end ball 0.002",
            ]
        );
    }
}
