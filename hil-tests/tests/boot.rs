//! The image starts, says who it is, and samples.

use bench::Scenario;
use hil_tests::{hear, run};
use wire::{flags, reset_cause};

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
