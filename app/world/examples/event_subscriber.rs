//! Somebody who wants to know when things are grasped, in a thread of their own: `cargo run -p world --example event_subscriber`

use world::events::{Class, Event, Filter, Hub, Kind, event_queue};

fn main() {
    // The fast side has one end; a run makes this queue itself.
    let (mut fast, events) = event_queue(1024);
    let mut hub = Hub::new(vec![events]);
    // A closure is called on the slow side; it should be quick.
    hub.subscribe(Filter::of(&[Class::Trial]), Box::new(|event: &Event| println!("slow side: {event:?}")));
    // A queue of its own suits whoever takes time. What finds no room in it is counted and told to this one alone.
    let mut grasps = hub.subscribe_queue(Filter::of(&[Class::Grasp]).entity(2), 64);
    let listener = std::thread::spawn(move || {
        while !grasps.is_abandoned() {
            while let Some(event) = grasps.receive(u64::MAX) {
                println!("listener: {} in tick {}", event.kind.facts().word, event.run_tick);
            }
            std::thread::sleep(std::time::Duration::from_millis(1));
        }
    });
    fast.send(Event { run_tick: 10, kind: Kind::Grasp { entity: 2, fingers: 0b11 } });
    fast.send(Event { run_tick: 500, kind: Kind::Release { entity: 2, lasted_s: 0.49 } });
    hub.deliver(u64::MAX);
    std::thread::sleep(std::time::Duration::from_millis(20));
    drop(hub);
    let _ = listener.join();
}
