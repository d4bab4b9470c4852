//! The slow side of orders: reads them, checks them against the scene that will run then, makes what they need, sends them.
//!
//! Model: a script is sent as a whole before the run begins, each order with its tick: so it plays the same on every clock.
//! The standard input is read by a thread of its own; its orders are for the next tick.

use super::gradual::MOST_TIMES;
use super::order::{Move, Order, Replacement, Scale, Which};
use super::queue::{OrderReceiver, OrderSender, order_queue};
use super::words::{self, Words};
use crate::fast_step::FastStep;
use crate::rig::Rig;
use io_driver::say::say;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{self, Receiver};

/// Where orders come from.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum OrderSource {
    /// A script.
    File(PathBuf),
    /// The standard input.
    Input,
}

/// The most orders of a script; and the most replaced worlds that are kept until the slow side frees them.
const MOST_ORDERS: usize = 1024;
/// The most worlds of a script: all are made before it begins.
const MOST_WORLDS: usize = 32;
/// Lines that may wait to be looked at; who writes more waits.
const LINES: usize = 64;

/// Whoever takes orders.
pub struct Desk {
    rig: Rig,
    sender: OrderSender,
    /// Whether anything is recorded: its columns are this scene's.
    is_recorded: bool,
    /// Of each entity, how many times the scene's stiffness and damping fingers will feel.
    times: Vec<[f64; 2]>,
    /// Of each entity, whether it can be moved.
    can_move: Vec<bool>,
    lines: Option<Receiver<String>>,
}

impl Desk {
    /// For a run of this rig; and the fast side's end of the queue.
    ///
    /// # Errors
    /// A script that cannot be read or played: its file, the line and what is wrong.
    pub fn open(rig: &Rig, source: &OrderSource, is_recorded: bool) -> Result<(Self, OrderReceiver), String> {
        let (sender, receiver) = order_queue(MOST_ORDERS);
        let mut desk = Self {
            rig: rig.clone(),
            sender,
            is_recorded,
            times: Vec::new(),
            can_move: Vec::new(),
            lines: None,
        };
        desk.take_note(&rig.fast_step().map_err(|error| error.to_string())?);
        match source {
            OrderSource::File(file) => desk.play(file)?,
            OrderSource::Input => desk.lines = Some(listen().map_err(|error| error.to_string())?),
        }
        Ok((desk, receiver))
    }

    /// The slow side's turn: what came in meanwhile. What is refused is told, and the run goes on.
    pub fn step(&mut self) {
        self.sender.free_replaced();
        let lines: Vec<String> = self.lines.iter().flat_map(Receiver::try_iter).collect();
        for line in lines {
            let result = words::parse(&line);
            let result = result.and_then(|words| words.map_or(Ok(()), |words| self.order(0, &words)));
            if let Err(error) = result {
                say(format_args!("phantom3: order refused: {error}"));
            }
        }
    }

    fn play(&mut self, file: &Path) -> Result<(), String> {
        let text =
            std::fs::read_to_string(file).map_err(|error| format!("--orders {}: {error}", file.display()))?;
        let (mut last_s, mut orders, mut worlds) = (0.0, 0, 0);
        for (number, line) in (1..).zip(text.lines()) {
            let wrong = |error: String| format!("{}:{number}: {error}", file.display());
            let Some((at_s, words)) = words::parse_timed(line).map_err(wrong)? else { continue };
            orders += 1;
            worlds += usize::from(matches!(words, Words::Reset | Words::Swap(_)));
            if at_s < last_s {
                return Err(wrong(format!(
                    "found at {at_s}, allowed: {last_s} s or later, as the line before it"
                )));
            }
            if orders > MOST_ORDERS || worlds > MOST_WORLDS {
                return Err(wrong(format!(
                    "too much for a script; allowed: {MOST_ORDERS} orders, and {MOST_WORLDS} of `reset` and `swap`"
                )));
            }
            last_s = at_s;
            let at_tick = (at_s * 1e9 / self.rig.period_ns as f64).round() as u64;
            self.order(at_tick, &words).map_err(wrong)?;
        }
        Ok(())
    }

    /// Makes an order of words, and sends it.
    fn order(&mut self, at_tick: u64, words: &Words) -> Result<(), String> {
        let order = match words {
            Words::Reset => {
                let step = self.rig.fast_step().map_err(|error| error.to_string())?;
                Order::Replace(Replacement::new(step, true))
            }
            Words::Scale(which, by, entity) => self.scale(*which, *by, entity.as_deref())?,
            Words::Move(entity, to_W, over_s) => {
                let number = self.number(entity)?;
                if !self.can_move[number] {
                    return Err(format!(
                        "{entity} cannot be moved: it moves by itself, or the scene has too many things that do \
                         for one list; allowed: entities without a mass, in scenes with up to 64 that have one"
                    ));
                }
                Order::Move(Move { entity: number, to_W: *to_W, over_s: *over_s })
            }
            Words::Swap(scene) => self.swap(scene)?,
        };
        match self.sender.send(at_tick, order) {
            true => Ok(()),
            false => Err(format!("{MOST_ORDERS} orders wait already")),
        }
    }

    fn scale(&mut self, which: Which, by: f64, entity: Option<&str>) -> Result<Order, String> {
        let entity = entity.map(|name| self.number(name)).transpose()?;
        let chosen = match entity {
            Some(number) => number..number + 1,
            None => 0..self.times.len(),
        };
        // A hair more than what rounding makes of ten times 1.1 and ten times 1 / 1.1.
        let allowed = MOST_TIMES.recip() * (1.0 - 1e-9)..=MOST_TIMES * (1.0 + 1e-9);
        let times = |times: &[f64; 2]| times[which as usize] * by;
        if let Some(at) = chosen.clone().find(|&at| !allowed.contains(&times(&self.times[at]))) {
            return Err(format!(
                "{} would have {} times what the scene says; allowed: {} to {MOST_TIMES} times",
                self.rig.scene.entities[at].name,
                times(&self.times[at]),
                MOST_TIMES.recip(),
            ));
        }
        self.times[chosen].iter_mut().for_each(|times| times[which as usize] *= by);
        Ok(Order::Scale(Scale { which, by, entity }))
    }

    fn swap(&mut self, scene: &Path) -> Result<Order, String> {
        if self.is_recorded {
            return Err("swap: the columns of a recording are those of the scene that it began with; \
                        leave out --record, or begin another run"
                .into());
        }
        let rig = self.rig.beside(scene).map_err(|error| error.to_string())?;
        let (needed, has) = (rig.device_count(), self.rig.device_count());
        if needed > has {
            return Err(format!(
                "swap: the fingers of {} need {needed} devices, the run has {has}; take fingers out of it, or \
                 begin with the scene that has more",
                scene.display()
            ));
        }
        let step = rig.fast_step().map_err(|error| error.to_string())?;
        if step.handed().is_some() {
            return Err(super::NEEDS_ONE_LIST.into());
        }
        self.rig = rig;
        self.take_note(&step);
        Ok(Order::Replace(Replacement::new(step, false)))
    }

    /// What is known of the scene that will run.
    fn take_note(&mut self, step: &FastStep) {
        self.can_move = (0..step.entities().len()).map(|entity| step.can_drive(entity)).collect();
        self.times = vec![[1.0; 2]; step.entities().len()];
    }

    fn number(&self, name: &str) -> Result<usize, String> {
        let entities = &self.rig.scene.entities;
        entities.iter().position(|entity| entity.name == name).ok_or_else(|| {
            let names: Vec<&str> = entities.iter().take(TOLD).map(|entity| entity.name.as_str()).collect();
            let more = if entities.len() > TOLD { ", ..." } else { "" };
            format!("there is no entity {name}; allowed: {}{more}", names.join(", "))
        })
    }
}

/// So many names are told.
const TOLD: usize = 20;

/// The lines of the standard input. The thread ends with it, or with the process.
fn listen() -> std::io::Result<Receiver<String>> {
    let (send, receive) = mpsc::sync_channel(LINES);
    std::thread::Builder::new().name("orders".into()).spawn(move || {
        for line in std::io::stdin().lines() {
            let Ok(line) = line else { break };
            if send.send(line).is_err() {
                break;
            }
        }
    })?;
    Ok(receive)
}
