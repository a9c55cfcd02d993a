//! The corruption campaign at length:
//! `cargo run --release -p wire --example corrupt -- --frames 100000000 --seed 1`.

#[path = "../tests/common/corruption.rs"]
mod corruption;

use corruption::{DAMAGES, board_frames, campaign};

fn main() -> std::process::ExitCode {
    let (mut frames, mut seed) = (1_000_000_u64, 1_u64);
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        let value = arguments.next().and_then(|value| value.parse().ok());
        match (argument.as_str(), value) {
            ("--frames", Some(value)) => frames = value,
            ("--seed", Some(value)) => seed = value,
            _ => {
                eprintln!("usage: corrupt [--frames N] [--seed N]");
                return 2.into();
            }
        }
    }
    let mut decoder = wire::Decoder::new();
    let progress = |done| eprint!("\r{done} of {frames}");
    let tally = campaign(
        &board_frames(seed),
        |byte| decoder.push(byte).map(Result::ok),
        frames,
        seed,
        progress,
    );
    eprintln!();
    println!("seed {seed}");
    println!("damaged frames           {:>12}", tally.damaged);
    for (damage, count) in DAMAGES.iter().zip(tally.by_damage) {
        println!("  {damage:<47} {count:>12}");
    }
    println!("of them accepted         {:>12}", tally.accepted);
    println!("intact frames in between {:>12}", tally.intact);
    println!("of them lost             {:>12}", tally.lost);
    println!("{:?}", decoder.counts());
    u8::from(tally.accepted + tally.lost > 0).into()
}
