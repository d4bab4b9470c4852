//! What became of the fast and the slow list, when a run has ended.

use std::fmt;
use world::lists::Handed;

/// Where all bodies were in the end, and how they came there.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ListsEnd {
    /// Bodies in the fast list.
    pub fast: usize,
    /// Bodies in the slow list; `None`: its thread had panicked.
    pub slow: Option<usize>,
    /// What was handed over.
    pub handed: Handed,
    /// Ticks that the slow list did not make up for.
    pub late_ticks: u64,
    /// Contacts of the slow list that had no room.
    pub left_out: u64,
}

impl fmt::Display for ListsEnd {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Handed { came, went, waits, unclaimed, parcels: _ } = self.handed;
        match self.slow {
            Some(slow) => write!(f, "{} fast, {slow} slow", self.fast)?,
            None => write!(f, "{} fast; THE SLOW ONE'S THREAD PANICKED: what it had stood still", self.fast)?,
        }
        write!(f, "; {came} came, {went} went")?;
        if waits.count() > 0 {
            write!(f, ", waits median {} and longest {} ticks", waits.median_ticks(), waits.most_ticks())?;
        }
        for (count, what) in [
            (self.late_ticks, "ticks that the slow one was late"),
            (self.left_out, "contacts of the slow one left out"),
            (unclaimed, "claims without room"),
        ] {
            if count > 0 {
                write!(f, ", {count} {what}")?;
            }
        }
        Ok(())
    }
}
