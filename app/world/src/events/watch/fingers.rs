//! A finger's contacts, ties and buttons.

use super::{Life, Teller, Touching};
use crate::events::{Change, Kind};

/// What a finger did in the tick before.
#[derive(Debug)]
pub(super) struct FingerWatch {
    /// In order of their entities.
    touched: Vec<Touched>,
    pub(super) tied: Option<u32>,
    buttons: u64,
}

/// A contact that lives.
#[derive(Debug, Clone, Copy)]
pub(super) struct Touched {
    pub(super) entity: u32,
    pub(super) is_body: bool,
    slips: bool,
    life: Life,
}

impl FingerWatch {
    /// Of a finger that touches at most so many entities at once.
    pub(super) fn new(most_touched: usize) -> Self {
        Self { touched: Vec::with_capacity(most_touched), tied: None, buttons: 0 }
    }

    /// Its contacts.
    pub(super) fn touched(&self) -> &[Touched] {
        &self.touched
    }

    /// Those of its device that are pressed.
    pub(super) fn buttons(&self) -> u64 {
        self.buttons
    }

    /// Number of what has begun and not ended.
    pub(super) fn open(&self) -> usize {
        let slips = self.touched.iter().filter(|touched| touched.slips).count();
        self.touched.len() + slips + usize::from(self.tied.is_some())
    }

    /// They were already.
    pub(super) fn go_on_from(&mut self, buttons: u64) {
        self.buttons = buttons;
    }

    /// First what has ended, then what goes on or begins.
    pub(super) fn look(&mut self, finger: u32, touching: &[Touching], teller: &mut Teller<'_>) {
        self.touched.retain(|was| {
            let stays = touching.binary_search_by_key(&was.entity, |is| is.entity).is_ok();
            if !stays {
                was.end(finger, teller);
            }
            stays
        });
        for is in touching {
            let place = self.touched.binary_search_by_key(&is.entity, |was| was.entity);
            let at = place.unwrap_or_else(|at| at);
            if place.is_err() {
                if self.touched.len() == self.touched.capacity() {
                    teller.out.lose();
                    continue;
                }
                let (entity, is_body) = (is.entity, is.is_body);
                self.touched.insert(at, Touched { entity, is_body, slips: false, life: Life::default() });
            }
            let touched = &mut self.touched[at];
            touched.life.go_on(&is.force_on_user_W, teller.now.dt_s, teller.now.dt_s);
            if place.is_err() {
                touched.tell(finger, Change::Begins, teller);
            }
            if std::mem::replace(&mut touched.slips, is.slips) != is.slips {
                touched.tell(finger, if is.slips { Change::Slips } else { Change::Sticks }, teller);
            }
        }
    }

    pub(super) fn look_at_device(
        &mut self,
        finger: u32,
        buttons: u64,
        tied: Option<u32>,
        teller: &mut Teller<'_>,
    ) {
        let mut changed = self.buttons ^ buttons;
        self.buttons = buttons;
        while changed != 0 {
            let button = changed.trailing_zeros();
            changed &= changed - 1;
            teller.tell(Kind::Button { finger, button, is_pressed: buttons >> button & 1 == 1 });
        }
        let was = std::mem::replace(&mut self.tied, tied);
        if was != tied {
            for (entity, change) in [(was, Change::Ends), (tied, Change::Begins)] {
                if let Some(entity) = entity {
                    teller.tell(Kind::Tie { finger, entity, change });
                }
            }
        }
    }
}

impl Touched {
    /// Nothing slides any more that does not touch.
    fn end(&self, finger: u32, teller: &mut Teller<'_>) {
        if self.slips {
            self.tell(finger, Change::Sticks, teller);
        }
        self.tell(finger, Change::Ends, teller);
    }

    fn tell(&self, finger: u32, change: Change, teller: &mut Teller<'_>) {
        teller.tell(Kind::FingerTouch { finger, entity: self.entity, change, life: self.life });
    }
}
