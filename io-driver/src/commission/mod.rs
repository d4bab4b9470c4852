//! The first trial of a device: do its counters and its motors turn the way its description says?
//!
//! Problem: a sign that is wrong in one motor turns every wall into a slingshot, and one that is wrong in an
//! encoder turns a friction into a push. Neither shows in a file, and full force is the wrong way to find out.
//! Model: with the driver in its commissioning mode (little force, little speed), first a person moves the tip
//! along each axis and the counters have to agree ([`hand_check`]); then each motor alone pushes, from nothing
//! up to that little force, until its joint has moved a little, and the direction has to agree ([`motor_check`]).
//! Nothing is fed back, so a wrong sign cannot run away. [`session`] is the commander that does it.

pub mod hand_check;
pub mod motor_check;
pub mod session;
