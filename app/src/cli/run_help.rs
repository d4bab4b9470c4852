//! Help of `run` below its options: orders and examples.

/// Orders, files and examples.
pub(super) const RUN_HELP: &str = "\
Orders (--orders FILE, or - for the standard input, where each line counts at once and has no `at`):
  at 0.5 friction cube coulomb mu=0.2            a friction model and its keys, as a scene says them
  at 1.0 stiffness 1.5 of cube                   times what it is; without `of`: of all entities
  at 1.0 damping 0.5                             the same; damping 0.5 of cube
  at 2.0 move cube to 0.1 0.025 0 in 0.5         metres, within 0.5 s
  at 2.0 turn cube about 0 1 0 by 1.57 in 0.5    radians; or: turn cube to W X Y Z in 0.5
  at 2.0 pose cube at 0 0.1 0 1 0 0 0 in 0.5     X Y Z and W X Y Z
  at 3.0 pause                                   nothing moves by itself until: resume
  at 3.5 resume
  at 4.0 reset                                   everything where it began
  at 5.0 swap other.toml                         another scene
  at 5.0 trial 1 begins                          a mark among the events; trial 1 ends
  at 5.0 key 32 down                             the like; key 32 up
  at 5.1 key 32 up at 5.05                       with the second in which it was, for who tells it later
  at 5.0 camera at 0 0.2 0.4 1 0 0 0             X Y Z and W X Y Z; devices that are attached to it go along
  at 5.0 text 0.5 0.2 4 Press the red cube       at the window: place (0 to 1), seconds, words
  # what follows a # is for people

Examples:
  phantom3 run config/scenes/lift.toml --record lift.mcap
  phantom3 run config/scenes/lift.toml --clock virtual --record - | head -3
  printf 'at 1.5 friction cube coulomb mu=0.1\\n' > slippery.txt
  phantom3 run config/scenes/lift.toml --clock virtual --orders slippery.txt --record dropped.csv";

#[cfg(test)]
mod tests {
    use super::RUN_HELP;
    use crate::control::words;

    #[test]
    fn every_order_in_the_help_is_one() {
        let orders: Vec<&str> =
            RUN_HELP.lines().map(str::trim_start).filter(|line| line.starts_with("at ")).collect();
        assert!(orders.len() > 10, "{orders:?}");
        for line in orders {
            // What stands behind two spaces explains it.
            let order = line.split("   ").next().unwrap_or(line);
            let (_, order) = words::split_time(order).expect(line).expect("an order");
            assert!(words::parse(order).expect(line).is_some(), "{line}");
        }
    }
}
