//! Scripted motion of a finger: pieces of even speed, which begin and end with a tick at every rate.

/// No round numbers: what would come to lie on the very rim of a circle would be decided by rounding. Speeds are multiplied by this.
pub(crate) const UNEVEN: f64 = 1.0173;

/// Pieces of a way.
#[derive(Debug, Clone)]
pub(crate) struct Motion {
    pub(crate) name: String,
    /// Speed (m/s), and for how long: an even number of milliseconds.
    pieces: Vec<(f64, u32)>,
}

impl Motion {
    pub(crate) fn new(name: impl Into<String>, pieces: &[(f64, u32)]) -> Self {
        assert!(pieces.iter().all(|(_, ms)| ms % 2 == 0), "whole ticks at 500 Hz");
        let pieces = pieces.iter().map(|(speed_m_s, ms)| (UNEVEN * speed_m_s, *ms)).collect();
        Self { name: name.into(), pieces }
    }

    /// 25 mm at one speed: five times the depth, ten times the strain of Dahl's law.
    pub(crate) fn steady(speed_m_s: f64) -> Self {
        let ms = 2 * (12.5 / speed_m_s.abs()) as u32;
        Self::new(format!("at {speed_m_s} m/s"), &[(speed_m_s, ms)])
    }

    /// Out and back, each way long enough to slide, at several speeds.
    pub(crate) fn reversals() -> Self {
        Self::new(
            "reversals",
            &[(0.08, 150), (-0.08, 160), (0.08, 160), (-0.2, 100), (0.06, 200), (-0.08, 100)],
        )
    }

    /// Standing still in the middle of a slide, after a reversal, and where nothing pulls.
    pub(crate) fn stops() -> Self {
        let pieces =
            [(0.08, 150), (0.0, 60), (0.08, 60), (0.0, 60), (-0.1, 16), (0.0, 40), (-0.1, 100), (0.0, 60)];
        Self::new("stops", &[&pieces[..], &[(0.3, 4), (0.0, 40), (0.08, 100), (0.0, 2), (0.08, 30)]].concat())
    }

    /// Strokes below and about what breaks away (2.5 mm), growing and shrinking, one within the other.
    pub(crate) fn strokes() -> Self {
        let pieces = [0.2e-3, 0.5e-3, 1.1e-3, 2.3e-3, 3.1e-3, 2.0e-3, 0.9e-3, 0.3e-3];
        let mut strokes: Vec<(f64, u32)> = Vec::new();
        for (i, amplitude_m) in pieces.into_iter().enumerate() {
            let speed_m_s = 0.05 + 0.01 * i as f64;
            let ms = 2 * (500.0 * amplitude_m / speed_m_s).round().max(1.0) as u32;
            strokes.extend([(speed_m_s, ms), (-speed_m_s, 2 * ms), (speed_m_s, ms)]);
        }
        Self::new("strokes", &strokes)
    }

    /// Where the HIP is at the end of each tick.
    pub(crate) fn places(&self, rate_hz: u32) -> impl Iterator<Item = f64> {
        let dt_s = 1.0 / f64::from(rate_hz);
        let mut from_m = 0.0;
        self.pieces.iter().flat_map(move |&(speed_m_s, ms)| {
            let (begin_m, ticks) = (from_m, ms * rate_hz / 1000);
            from_m += speed_m_s * f64::from(ticks) * dt_s;
            (1..=ticks).map(move |tick| begin_m + speed_m_s * f64::from(tick) * dt_s)
        })
    }
}
