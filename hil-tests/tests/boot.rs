//! The image starts, says who it is, and samples.

use bench::Scenario;
use hil_tests::{at, hear, run};
use wire::{Command, Status, flags, reset_cause};

#[test]
fn it_says_hello_and_then_samples_at_20_hz_without_a_gap() {
    let begun = std::time::Instant::now();
    let heard = hear(&run(Scenario::lively(1), 60.0)).expect("it runs");
    let wall = begun.elapsed().as_secs_f64();
    assert_eq!(heard.link().rejected(), 0);
    let (at, hello) = heard.hellos().next().expect("a hello frame");
    assert!(at < 0.3, "hello after {at} s");
    assert_eq!(hello.reset_cause, reset_cause::POWER_ON);
    assert_eq!((hello.restarts, hello.next_seq), (0, 0));
    assert_eq!(
        (hello.tick_ns, hello.period_ticks, hello.baud_divisor),
        (4_000, 12_500, 25)
    );
    let samples: Vec<_> = heard.samples().collect();
    assert!((1190..=1200).contains(&samples.len()), "{}", samples.len());
    for (n, (_, sample)) in samples.iter().enumerate() {
        assert_eq!(usize::from(sample.seq), n);
        assert_eq!(sample.t_ticks, (n as u32 + 1) * 12_500);
        assert_eq!(sample.flags, flags::IN_ORDER, "sample {n}");
    }
    println!("60 simulated s in {wall:.2} s");
}

#[test]
fn a_reboot_by_command_is_answered_and_comes_back_by_the_watchdog_with_its_cause() {
    let mut run = run(Scenario::lively(6), 20.0);
    run.requests = vec![at(5.0, 1, Command::Reboot), at(12.0, 2, Command::GetHello)];
    let heard = hear(&run).expect("it runs");
    let replies: Vec<_> = heard.replies().map(|(_, reply)| reply).collect();
    let answered: Vec<_> = replies
        .iter()
        .map(|reply| (reply.number, reply.status))
        .collect();
    assert_eq!(answered, [(1, Status::Ok), (2, Status::Ok)]);
    let hellos: Vec<_> = heard.hellos().collect();
    let causes: Vec<_> = hellos.iter().map(|(_, hello)| hello.reset_cause).collect();
    assert_eq!(
        causes,
        [
            reset_cause::POWER_ON,
            reset_cause::WATCHDOG,
            reset_cause::WATCHDOG
        ]
    );
    assert_eq!((hellos[1].1.restarts, hellos[1].1.next_seq), (1, 0));
    // Up to 16 ms of watchdog, 220 ms of the sensors' start, and the frame.
    assert!(
        (5.2..5.4).contains(&hellos[1].0),
        "back at {} s",
        hellos[1].0
    );
    let back = hellos[1].0;
    let after: Vec<_> = heard.samples().filter(|&(t, _)| t > back).collect();
    for (n, (_, sample)) in after.iter().enumerate() {
        assert_eq!(
            (usize::from(sample.seq), sample.flags),
            (n, flags::IN_ORDER)
        );
    }
    let health = heard.last_health();
    assert_eq!(health.faults.get(wire::Fault::WatchdogReset), 1);
}
