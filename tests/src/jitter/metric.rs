//! What is measured, and how each figure is to be read.

use serde::{Deserialize, Serialize};

/// One quantity of one style; a series in the results.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub enum Metric {
    /// The hybrid wait alone in a process.
    #[serde(rename = "hybrid.wake_error")]
    HybridWake,
    /// The reference's: cyclictest, or a plain sleep.
    #[serde(rename = "reference.wake_error")]
    ReferenceWake,
    /// The driver's loop, as its own histogram says.
    #[serde(rename = "driver.wake_error")]
    DriverWake,
    /// From the deadline to the encoders read.
    #[serde(rename = "driver.deadline_to_read")]
    DeadlineToRead,
    /// The driver's own work.
    #[serde(rename = "driver.cycle")]
    Cycle,
    /// From frame to command.
    #[serde(rename = "driver.round_trip")]
    RoundTrip,
    /// Age of the encoders behind the motors' force.
    #[serde(rename = "driver.force_age")]
    ForceAge,
    /// From encoders to motors of the same tick.
    #[serde(rename = "driver.end_to_end")]
    EndToEnd,
}

impl Metric {
    /// All, in the order of tables.
    pub const ALL: [Self; 8] = [
        Self::HybridWake,
        Self::ReferenceWake,
        Self::DriverWake,
        Self::DeadlineToRead,
        Self::Cycle,
        Self::RoundTrip,
        Self::ForceAge,
        Self::EndToEnd,
    ];

    /// Its name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::HybridWake => "hybrid.wake_error",
            Self::ReferenceWake => "reference.wake_error",
            Self::DriverWake => "driver.wake_error",
            Self::DeadlineToRead => "driver.deadline_to_read",
            Self::Cycle => "driver.cycle",
            Self::RoundTrip => "driver.round_trip",
            Self::EndToEnd => "driver.end_to_end",
            Self::ForceAge => "driver.force_age",
        }
    }

    /// What it means.
    pub fn meaning(self) -> &'static str {
        match self {
            Self::HybridWake => {
                "how late a loop that sleeps and then spins wakes, alone in a process; skipped deadlines included"
            }
            Self::ReferenceWake => "how late the reference wakes: cyclictest, or a plain absolute sleep",
            Self::DriverWake => {
                "how late the driver's loop wakes against the deadline it serves, by its own histogram (3 % wide buckets); \
                 skipped deadlines are counted apart"
            }
            Self::DeadlineToRead => {
                "from a tick's deadline to its encoders read, every frame; skipped deadlines included"
            }
            Self::Cycle => {
                "the driver's own work in a tick without waiting for the reply, by its own histogram (3 % wide buckets)"
            }
            Self::RoundTrip => "from a frame's doorbell to its accepted command, every answered frame",
            Self::EndToEnd => "from a tick's encoders read to its motors written, every frame",
            Self::ForceAge => {
                "from the encoders read for the command in force to the motors written with it, every frame under a lease"
            }
        }
    }

    /// The one with this name in files.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|metric| metric.name() == name)
    }
}

/// What a slice measures.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Style {
    /// The hybrid wait alone.
    Hybrid,
    /// cyclictest or a plain sleep.
    Reference,
    /// Driver and application.
    Driver,
}

impl Style {
    /// Its name in options and files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Hybrid => "hybrid",
            Self::Reference => "reference",
            Self::Driver => "driver",
        }
    }

    /// The one with this name.
    pub fn from_name(name: &str) -> Option<Self> {
        [Self::Hybrid, Self::Reference, Self::Driver].into_iter().find(|style| style.name() == name)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_in_files_lead_back() {
        for metric in Metric::ALL {
            assert_eq!(Metric::from_name(metric.name()), Some(metric));
            assert_eq!(serde_json::to_value(metric).unwrap(), metric.name());
        }
        assert_eq!(Style::from_name("driver"), Some(Style::Driver));
        assert_eq!(Metric::from_name("driver.luck"), None);
    }
}
