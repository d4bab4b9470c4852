//! How far an estimate is from the truth.

use crate::motion::{Course, Sample};
use crate::rivals::Estimator;
use io_driver::device::TickTime;
use io_driver::kinematics::Mechanism;
use nalgebra::Vector3;

/// An estimate against the truth; velocities in m/s or rad/s.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Score {
    pub(crate) rms: f64,
    pub(crate) max: f64,
    /// The delay of the truth (s) that the estimate fits best; `None` where the velocity is constant.
    pub(crate) lag_s: Option<f64>,
}

/// What a filter needs to begin is not its fault (s).
const RUN_IN_S: f64 = 0.05;
/// Delays that are tried (s).
const LAG_STEP_S: f64 = 1e-4;
const LAGS: std::ops::Range<i32> = -20..120;

/// What an estimator makes of a movement: velocities of the joints (rad/s), of the tip (m/s).
pub(crate) fn estimate(
    estimator: &mut dyn Estimator,
    course: &Course,
    samples: &[Sample],
    period_ns: u64,
) -> Vec<(Vector3<f64>, Vector3<f64>)> {
    let rad_per_count = Vector3::from(course.map.rad_per_count());
    let one = |sample: &Sample| {
        let time = TickTime::counted(sample.tick, period_ns, 0);
        let rates = estimator.observe(time, sample.counts.map(|count| count as f64));
        let joints = Vector3::from(rates).component_mul(&rad_per_count);
        (joints, course.arm.mechanism.jacobian(sample.joints_rad) * joints)
    };
    samples.iter().map(one).collect()
}

/// Scores of the joints together and of the tip, given the true velocities by time.
pub(crate) fn scores(
    truth: impl Fn(f64) -> (Vector3<f64>, Vector3<f64>),
    is_steady: bool,
    samples: &[Sample],
    found: &[(Vector3<f64>, Vector3<f64>)],
) -> [Score; 2] {
    let judged: Vec<_> = samples.iter().zip(found).filter(|(sample, _)| sample.time_s > RUN_IN_S).collect();
    let error = |delay_s: f64, thin: usize| -> [Vec<f64>; 2] {
        let both = judged.iter().step_by(thin).map(|(sample, (joints, tip))| {
            let (true_joints, true_tip) = truth(sample.time_s - delay_s);
            ((joints - true_joints).norm(), (tip - true_tip).norm())
        });
        let (joints, tip) = both.unzip();
        [joints, tip]
    };
    let rms = |errors: &[f64]| (errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64).sqrt();
    let lags = LAGS.map(|step| f64::from(step) * LAG_STEP_S).map(|lag_s| (lag_s, error(lag_s, 4)));
    let lags: Vec<_> = lags.collect();
    let now = error(0.0, 1);
    std::array::from_fn(|which| {
        let by_lag = |lag: &&(f64, [Vec<f64>; 2])| rms(&lag.1[which]);
        let best = lags.iter().min_by(|a, b| by_lag(a).total_cmp(&by_lag(b))).expect("some are tried");
        Score {
            rms: rms(&now[which]),
            max: now[which].iter().copied().fold(0.0, f64::max),
            lag_s: (!is_steady).then_some(best.0),
        }
    })
}
