//! What a hand-over costs on the fast side, for each body of an island.
//!
//! Run `cargo bench -p phantom3 --bench hand_over`. Islands of cubes that stand on a floor and on each other are in the slow
//! list. A finger appears beside one after the other: it is claimed, comes, is stepped for a while, and goes when the finger
//! has gone. Timed is what the fast thread does for it: `accept` is what `begin_tick` takes in the ticks in which parcels
//! come, `release` what `end_tick` takes in those in which they go, less what either takes in other ticks. The slow side's
//! turns, ten ticks apart, are not timed. Between two visits of an island all others have been visited.
//! Visits in which the thread was preempted are left out and counted; so are page faults, of which there are to be none.
#![allow(missing_docs, non_snake_case, unused_crate_dependencies)]

use std::hint::black_box;
use std::time::Instant;

use haptics::{Cuboid, Entity, Friction, Plane};
use nalgebra::{Isometry3, Vector3};
use physics::{Body, MassProperties, Settings, Sleep};
use rt_core::usage::ResourceUsage;
use world::lists::{ListSettings, Lists, Reach};

const SIZE: f64 = 0.04;
/// From one island to the next (m).
const APART: f64 = 0.5;
/// Of a visit, with the finger there and without it.
const TICKS: [usize; 2] = [30, 30];
const DT: f64 = 1e-3;

fn main() {
    if std::env::args().any(|argument| argument == "--test") {
        return;
    }
    let groups = ["accept", "release", "both", "waited", "left"];
    println!(
        "{:<22} {:>15} {:>15} {:>15} {:>8} {:>5}",
        "us per body", groups[0], groups[1], groups[2], groups[3], groups[4]
    );
    println!("{:<22} {0:>15} {0:>15} {0:>15} {:>8} {:>5}", "median   p99.9", "ticks", "out");
    for (bodies, sleeps, islands, visits) in [
        (1, true, 60, 4000),
        (5, true, 60, 4000),
        (20, true, 60, 2000),
        (1, false, 40, 2000),
        (5, false, 8, 2000),
    ] {
        Bench::new(bodies, sleeps, islands).measure(visits);
    }
}

struct Bench {
    bodies: usize,
    sleeps: bool,
    islands: usize,
    entities: Vec<Entity>,
    lists: Lists,
    tick: u64,
}

/// What the fast side did in a tick.
struct Tick {
    /// Its beginning and its end (ns).
    took_ns: [f64; 2],
    /// Whether parcels came, and went.
    crossed: [bool; 2],
}

/// Of a visit: how long it took on either way, in so many ticks.
type Cost = ([f64; 2], [f64; 2]);

impl Bench {
    /// Stacks of so many cubes; those of more than five stand two high in a row.
    fn new(bodies: usize, sleeps: bool, islands: usize) -> Self {
        let rough = |entity: Entity| entity.with_friction(Friction::coulomb(0.5).unwrap()).unwrap();
        let floor = Entity::new(Plane::new(Vector3::y(), 0.0).unwrap(), Isometry3::identity(), 2000.0);
        let mut entities = vec![rough(floor.unwrap())];
        for island in 0..islands {
            for at in 0..bodies {
                let high = if bodies > 5 { 2 } else { 5 };
                let (column, row) = ((at / high) as f64, (at % high) as f64);
                // Pressed against each other a little, so that they stay neighbours.
                let x = island as f64 * APART + 0.998 * SIZE * column;
                let cube = Entity::new(
                    Cuboid::new([SIZE; 3]).unwrap(),
                    Isometry3::translation(x, SIZE * (0.5 + row), 0.0),
                    2000.0,
                );
                entities.push(rough(cube.unwrap().with_damping(3.0).unwrap()));
            }
        }
        let body = |entity: &Entity| {
            Body::at_rest(MassProperties::of_shape(&entity.shape, 0.05).unwrap(), &entity.X_WB)
        };
        let all: Vec<_> = (1..entities.len()).map(|at| (at, body(&entities[at]))).collect();
        let physics = Settings { sleep: sleeps.then(Sleep::default), ..Settings::default() };
        let settings = ListSettings { near_m: 0.06, far_m: 0.08, ahead_s: 0.02, fast_bodies: 0 };
        let lists = Lists::new(&entities, &all, physics, settings).unwrap();
        let mut bench = Self { bodies, sleeps, islands, entities, lists, tick: 0 };
        // Until they sleep.
        for _ in 0..if sleeps { 3000 } else { 300 } {
            bench.tick(None);
        }
        bench
    }

    fn tick(&mut self, finger: Option<Reach>) -> Tick {
        let Lists { fast, hand_over, slow } = &mut self.lists;
        let before = hand_over.handed().parcels;
        let begin = Instant::now();
        hand_over.begin_tick(fast, &mut self.entities, black_box(finger).into_iter(), (self.tick, DT));
        let began_ns = begin.elapsed().as_nanos() as f64;
        fast.step(&mut self.entities, &mut [], DT);
        let begin = Instant::now();
        hand_over.end_tick(fast, &self.entities);
        let ended_ns = begin.elapsed().as_nanos() as f64;
        let after = hand_over.handed().parcels;
        self.tick += 1;
        if self.tick.is_multiple_of(10) {
            slow.turn(10, DT);
        }
        Tick { took_ns: [began_ns, ended_ns], crossed: [before[0] < after[0], before[1] < after[1]] }
    }

    fn measure(&mut self, visits: usize) {
        let began = self.lists.hand_over.handed();
        // Written to before, so that what is noted here makes no page faults.
        let idle_ticks = visits * (TICKS[0] + TICKS[1]);
        let mut costs = vec![([1.0; 2], [1.0; 2]); visits];
        let mut idle = [(); 2].map(|()| vec![1.0; idle_ticks]);
        costs.clear();
        idle.iter_mut().for_each(Vec::clear);
        let mut faults = 0;
        for visit in 0..visits {
            let at_x = (visit * 7 % self.islands) as f64 * APART;
            let hip_W = Vector3::new(at_x, 0.5 * SIZE, 0.05);
            let finger = Reach { hip_W, velocity_W: Vector3::zeros(), radius_m: 0.0 };
            let (mut took_ns, mut ticks) = ([0.0; 2], [0.0; 2]);
            let before = ResourceUsage::of_thread();
            for tick in 0..TICKS[0] + TICKS[1] {
                let tick = self.tick((tick < TICKS[0]).then_some(finger));
                for side in 0..2 {
                    if tick.crossed[side] {
                        took_ns[side] += tick.took_ns[side];
                        ticks[side] += 1.0;
                    } else {
                        idle[side].push(tick.took_ns[side]);
                    }
                }
            }
            let usage = ResourceUsage::of_thread().delta(&before);
            faults += usage.minor_faults;
            if usage.involuntary_switches == 0 {
                costs.push((took_ns, ticks));
            }
        }
        let handed = self.lists.hand_over.handed();
        // A cube that stood at a row's end may have come to stand alone.
        let came = (handed.came - began.came) as f64 / visits as f64;
        assert!(came > 0.99 * self.bodies as f64 && handed.came == handed.went, "{handed:?}");
        let idle_ns = idle.map(|mut all| share_of(&mut all, 0.5));
        let per_body =
            |side: usize, (took_ns, ticks): &Cost| (took_ns[side] - ticks[side] * idle_ns[side]) / 1e3 / came;
        let column = |of: &dyn Fn(&Cost) -> f64| {
            let mut all: Vec<f64> = costs.iter().map(of).collect();
            format!("{:>6.2} {:>8.2}", share_of(&mut all, 0.5), share_of(&mut all, 0.999))
        };
        println!(
            "{:<22} {} {} {} {:>8} {:>5}{}",
            format!("{} in an island{}", self.bodies, if self.sleeps { "" } else { ", awake" }),
            column(&|cost| per_body(0, cost)),
            column(&|cost| per_body(1, cost)),
            column(&|cost| per_body(0, cost) + per_body(1, cost)),
            format!("{}, {}", handed.waits.median_ticks(), handed.waits.most_ticks()),
            visits - costs.len(),
            if faults > 0 { format!("   {faults} PAGE FAULTS") } else { String::new() },
        );
    }
}

/// What this share of them does not exceed.
fn share_of(all: &mut [f64], share: f64) -> f64 {
    all.sort_unstable_by(f64::total_cmp);
    all.get((all.len().saturating_sub(1) as f64 * share) as usize).copied().unwrap_or_default()
}
