//! Two programs measured in turns, and when one of them is worse than the other.
//!
//! Problem: on a shared or virtual machine nearly all misses are the machine's, and they come in bursts: one
//! stall of the hypervisor misses many ticks at once. A fixed limit would be either useless or wrong.
//! Model: ours and the reference take turns in slices, so that both meet the same machine. Let a_i and b_i
//! be their misses in slice i of n. If both suffer from the same process of stalls, the difference of the
//! sums has mean 0 and variance n (s_a^2 + s_b^2), estimated from the slices themselves, whatever the
//! bursts look like; but never below that of independent misses (Poisson), sum a + sum b. Ours is worse if
//! the difference exceeds three standard deviations, a chance of about 1 in 700 for equals.
//! One great burst makes that variance so large that a small and steady difference hides behind it. So the
//! slices vote too: ours is worse in a slice if it exceeds the reference there by more than one standard
//! deviation of independent misses, and worse as a whole if it is so in more slices than three standard
//! deviations of n tossed coins explain. For equals even one half would be much: a vote has a chance of 1 in 6.

use crate::bare_loop::Outcome;
use std::fmt;

/// What was measured so far.
#[derive(Debug, Default)]
pub struct Comparison {
    slices: Vec<(Outcome, Outcome)>,
}

impl Comparison {
    /// Adds a slice of ours and the reference's next to it.
    pub fn add(&mut self, ours: Outcome, reference: Outcome) {
        self.slices.push((ours, reference));
    }

    /// All slices of ours, and all of the reference's.
    pub fn totals(&self) -> (Outcome, Outcome) {
        self.slices.iter().fold((Outcome::none(), Outcome::none()), |(mut ours, mut reference), (a, b)| {
            ours.add(a);
            reference.add(b);
            (ours, reference)
        })
    }

    /// How many more than the reference ours may count of `what` without being worse.
    pub fn margin(&self, what: impl Fn(&Outcome) -> u64) -> f64 {
        let side = |of: fn(&(Outcome, Outcome)) -> &Outcome| -> Vec<f64> {
            self.slices.iter().map(|slice| what(of(slice)) as f64).collect()
        };
        let (ours, reference) = (side(|slice| &slice.0), side(|slice| &slice.1));
        let independent: f64 = ours.iter().chain(&reference).sum();
        let bursts = self.slices.len() as f64 * (variance(&ours) + variance(&reference));
        // With few events the distribution is skewed: a handful more says nothing.
        3.0 * independent.max(bursts).sqrt() + FEW
    }

    /// In how many slices ours is worse.
    pub fn worse_slices(&self, what: impl Fn(&Outcome) -> u64) -> usize {
        let is_worse = |(ours, reference): &&(Outcome, Outcome)| {
            let (ours, reference) = (what(ours) as f64, what(reference) as f64);
            ours > reference + (ours + reference).sqrt()
        };
        self.slices.iter().filter(is_worse).count()
    }

    /// Fails if ours counts more of `what` than the reference explains.
    ///
    /// # Panics
    /// Then.
    pub fn assert_not_worse(&self, name: &str, what: impl Fn(&Outcome) -> u64) {
        let (ours, reference) = self.totals();
        let (ours, reference, margin) = (what(&ours), what(&reference), self.margin(&what));
        let (worse, slices) = (self.worse_slices(&what), self.slices.len() as f64);
        let coins = slices / 2.0 + 3.0 * slices.sqrt() / 2.0;
        println!("{name}: ours {ours}, reference {reference}, allowed difference {margin:.0}");
        println!("{name}: worse in {worse} of {slices} slices, allowed {coins:.1}");
        assert!(ours as f64 <= reference as f64 + margin, "{name}: {ours} against {reference} + {margin:.0}");
        assert!(worse as f64 <= coins, "{name}: worse in {worse} of {slices} slices");
    }
}

const FEW: f64 = 5.0;

fn variance(values: &[f64]) -> f64 {
    let n = values.len() as f64;
    if n < 2.0 {
        return 0.0;
    }
    let mean = values.iter().sum::<f64>() / n;
    values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / (n - 1.0)
}

impl fmt::Display for Comparison {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "{:>5} {:9} {:>8} {:>7} {:>8} | wake error [us]: {:>7} {:>8} {:>9} {:>9} | round trip: {:>7} {:>8} {:>9} {:>9}",
            "slice",
            "",
            "ticks",
            "missed",
            "overruns",
            "p50",
            "p99",
            "p99.9",
            "max",
            "p50",
            "p99",
            "p99.9",
            "max"
        )?;
        for (index, (ours, reference)) in self.slices.iter().enumerate() {
            line(f, &(index + 1).to_string(), "ours", ours)?;
            line(f, "", "reference", reference)?;
        }
        let (ours, reference) = self.totals();
        line(f, "all", "ours", &ours)?;
        line(f, "", "reference", &reference)
    }
}

fn line(f: &mut fmt::Formatter<'_>, slice: &str, whose: &str, outcome: &Outcome) -> fmt::Result {
    let us = |ns: u64| ns as f64 / 1e3;
    let (wake, trip) = (outcome.wake_error.summary(), outcome.round_trip.summary());
    writeln!(
        f,
        "{slice:>5} {whose:9} {:8} {:7} {:8} | {:16} {:7.2} {:8.2} {:9.2} {:9.2} | {:11} {:7.2} {:8.2} {:9.2} {:9.2}",
        outcome.ticks,
        outcome.missed,
        outcome.overruns,
        "",
        us(wake.p50),
        us(wake.p99),
        us(wake.p999),
        us(wake.max),
        "",
        us(trip.p50),
        us(trip.p99),
        us(trip.p999),
        us(trip.max),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn missed(counts: &[(u64, u64)]) -> Comparison {
        let outcome = |missed| Outcome { ticks: 1000, missed, ..Outcome::none() };
        Comparison { slices: counts.iter().map(|(a, b)| (outcome(*a), outcome(*b))).collect() }
    }

    #[test]
    fn rare_misses_are_compared_as_independent_ones() {
        // Four slices with 9 against 7: variance 16 of independent misses is above that of the slices.
        let comparison = missed(&[(2, 2), (2, 2), (3, 1), (2, 2)]);
        assert_eq!(comparison.margin(|o| o.missed), 3.0 * 4.0 + FEW);
        comparison.assert_not_worse("missed", |o| o.missed);
    }

    #[test]
    fn one_burst_does_not_condemn() {
        missed(&[(0, 0), (400, 0), (0, 0), (0, 0), (0, 0)]).assert_not_worse("missed", |o| o.missed);
    }

    #[test]
    #[should_panic(expected = "missed: 400 against 40")]
    fn misses_in_every_slice_do() {
        missed(&[(100, 10); 4]).assert_not_worse("missed", |o| o.missed);
    }

    #[test]
    #[should_panic(expected = "missed: worse in 12 of 12 slices")]
    fn a_steady_difference_does_not_hide_behind_a_burst() {
        let mut counts = [(40, 10); 12];
        counts[3] = (4000, 20);
        missed(&counts).assert_not_worse("missed", |o| o.missed);
    }

    #[test]
    fn half_of_the_slices_may_be_worse() {
        missed(&[(40, 10), (10, 40), (3, 3), (40, 10), (10, 40), (40, 10)])
            .assert_not_worse("missed", |o| o.missed);
    }
}
