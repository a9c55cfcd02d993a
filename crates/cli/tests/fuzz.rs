//! Any bytes in any file that is read: mutations of a corpus by a fixed seed, on stable. `cargo xtask fuzz` gives it minutes.
//!
//! `IMU_STAND_FUZZ_SECONDS` is how long for each target, `IMU_STAND_FUZZ_TARGET` one of them, `IMU_STAND_SEED` the seed. An
//! input that fails is kept in target/tmp/fuzz, and `IMU_STAND_FUZZ_INPUT` runs it again.

#[path = "fuzz/targets.rs"]
mod targets;

use std::alloc::{GlobalAlloc, Layout, System};
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use rand_core::{Rng as _, SeedableRng as _};
use rand_xoshiro::Xoshiro256PlusPlus;
use targets::TARGETS;

/// Counts what is allocated.
struct Counting;

static NOW: AtomicUsize = AtomicUsize::new(0);
static MOST: AtomicUsize = AtomicUsize::new(0);

fn more(bytes: usize) {
    let now = NOW.fetch_add(bytes, Ordering::Relaxed) + bytes;
    MOST.fetch_max(now, Ordering::Relaxed);
}

// SAFETY: what is asked goes to the system's allocator as it is.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        more(layout.size());
        // SAFETY: the caller's.
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        more(layout.size());
        // SAFETY: the caller's.
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn dealloc(&self, block: *mut u8, layout: Layout) {
        NOW.fetch_sub(layout.size(), Ordering::Relaxed);
        // SAFETY: the caller's.
        unsafe { System.dealloc(block, layout) }
    }

    unsafe fn realloc(&self, block: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        more(size);
        NOW.fetch_sub(layout.size(), Ordering::Relaxed);
        // SAFETY: the caller's.
        unsafe { System.realloc(block, layout, size) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// Time of the processor that an input may take: inputs are of some kilobytes, and the build is for tests.
const AT_MOST: Duration = Duration::from_secs(10);
/// A file may take 1 GiB more than itself (SECURITY.md); what is made of that while it is read is as much again.
const MEMORY: usize = 2 << 30;
/// Bytes of an input, at the most.
const LONGEST: usize = 20_000;

/// Makes inputs.
struct Mutator {
    rng: Xoshiro256PlusPlus,
    corpus: Vec<Vec<u8>>,
}

/// Numbers at which something happens.
const EDGES: [u64; 10] = [
    0,
    1,
    0x7f,
    0xff,
    0x7fff,
    0xffff,
    0x7fff_ffff,
    0xffff_ffff,
    i64::MAX as u64,
    u64::MAX,
];
/// Words at which something happens in a text.
const WORDS: [&str; 16] = [
    "nan",
    "inf",
    "-1",
    "1e308",
    "1e-320",
    "9223372036854775808",
    "0",
    "\"",
    ",",
    ";",
    "\n",
    "=",
    "[",
    "\u{feff}",
    "2024-02-30 25:61:61",
    "\t",
];

impl Mutator {
    fn below(&mut self, n: usize) -> usize {
        ((u128::from(self.rng.next_u64()) * n as u128) >> 64) as usize
    }

    fn input(&mut self) -> Vec<u8> {
        let k = self.below(self.corpus.len());
        let mut input = self.corpus[k].clone();
        for _ in 0..=self.below(5) {
            self.mutate(&mut input);
        }
        input.truncate(LONGEST);
        input
    }

    fn mutate(&mut self, input: &mut Vec<u8>) {
        let at = self.below(input.len() + 1);
        let to = (at + 1 + self.below(64)).min(input.len());
        match self.below(10) {
            0 => input.insert(at, self.rng.next_u64() as u8),
            1 => input.truncate(at),
            2 => drop(input.drain(at..to)),
            3 => {
                let part = input[at..to].to_vec();
                input.splice(at..at, part);
            }
            4 => {
                let other = self.below(self.corpus.len());
                let other = self.corpus[other].clone();
                let from = self.below(other.len() + 1);
                input.truncate(at);
                input.extend(&other[from..]);
            }
            5 => {
                let edge = EDGES[self.below(EDGES.len())];
                let bytes = match self.below(2) {
                    0 => edge.to_le_bytes(),
                    _ => edge.to_be_bytes(),
                };
                let width = 1 << self.below(4);
                let from = if self.below(2) == 0 { 0 } else { 8 - width };
                for (place, byte) in input.iter_mut().skip(at).zip(&bytes[from..from + width]) {
                    *place = *byte;
                }
            }
            6 => {
                let word = WORDS[self.below(WORDS.len())];
                let end = (at + self.below(8)).min(input.len());
                input.splice(at..end, word.bytes());
            }
            _ => {
                if let Some(byte) = input.get_mut(at) {
                    *byte ^= 1 << (self.rng.next_u64() % 8);
                }
            }
        }
    }
}

/// Files that a target's inputs are made of.
fn corpus(target: &str) -> Vec<Vec<u8>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../../fuzz/corpus")
        .join(target);
    let committed = std::fs::read_dir(&folder).into_iter().flatten();
    let mut paths: Vec<PathBuf> = committed
        .map(|entry| entry.expect("an entry").path())
        .collect();
    // The files that readers are tested with.
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data");
    let endings: &[&str] = match target {
        "npz" => &["npz"],
        "parquet" => &["parquet"],
        "mat" => &["mat"],
        "log" => &["bag", "mcap", "ulg"],
        _ => &[],
    };
    for entry in std::fs::read_dir(data).expect("test data") {
        let path = entry.expect("an entry").path();
        let ending = path
            .extension()
            .and_then(|e| e.to_str())
            .unwrap_or_default();
        if endings.contains(&ending) || (target == "hdf5" && path.ends_with("imu73.mat")) {
            paths.push(path);
        }
    }
    paths.sort();
    assert!(!paths.is_empty(), "no corpus in {}", folder.display());
    paths
        .into_iter()
        .map(|path| std::fs::read(path).expect("a file"))
        .collect()
}

/// The input that runs, and since when, ms; 0 while none does.
static SINCE: AtomicU64 = AtomicU64::new(0);
static RUNNING: Mutex<Vec<u8>> = Mutex::new(Vec::new());

/// Ends the process where an input never ends.
fn watch(began: Instant, kept: PathBuf) {
    std::thread::spawn(move || {
        loop {
            std::thread::sleep(Duration::from_millis(500));
            let since = SINCE.load(Ordering::Relaxed);
            let now = began.elapsed().as_millis() as u64;
            if since > 0 && now > since + 6 * AT_MOST.as_millis() as u64 {
                let path = kept.join("endless");
                let input = RUNNING.lock().expect("one thread writes it").clone();
                let done = std::fs::write(&path, input);
                eprintln!("an input does not end: {}: {done:?}", path.display());
                std::process::abort();
            }
        }
    });
}

/// Time that this thread has computed: the computer may be busy with other things. Elsewhere than on Unix, time.
fn processor_time() -> Duration {
    #[cfg(unix)]
    {
        let mut time = libc::timespec {
            tv_sec: 0,
            tv_nsec: 0,
        };
        // SAFETY: a place for the answer.
        let done = unsafe { libc::clock_gettime(libc::CLOCK_THREAD_CPUTIME_ID, &raw mut time) };
        assert_eq!(done, 0, "{}", std::io::Error::last_os_error());
        Duration::new(time.tv_sec as u64, time.tv_nsec as u32)
    }
    #[cfg(not(unix))]
    {
        static BEGAN: std::sync::OnceLock<Instant> = std::sync::OnceLock::new();
        BEGAN.get_or_init(Instant::now).elapsed()
    }
}

fn set(name: &str) -> Option<String> {
    std::env::var(name).ok()
}

fn number(name: &str, or: f64) -> f64 {
    set(name).map_or(or, |text| {
        text.parse()
            .unwrap_or_else(|_| panic!("{name} is no number: {text}"))
    })
}

#[test]
fn any_bytes_in_a_file_are_answered_in_words_in_time_and_in_bounded_memory() {
    let seconds = number("IMU_STAND_FUZZ_SECONDS", 2.0);
    let seed = number("IMU_STAND_SEED", 20_261_124.0) as u64;
    let only = set("IMU_STAND_FUZZ_TARGET");
    let kept = Path::new(env!("CARGO_TARGET_TMPDIR")).join("fuzz");
    std::fs::create_dir_all(&kept).expect("a folder");
    let began = Instant::now();
    watch(began, kept.clone());
    let mut ran = 0;
    for (name, check) in TARGETS {
        if only.as_deref().is_some_and(|only| only != name) {
            continue;
        }
        ran += 1;
        if let Some(input) = set("IMU_STAND_FUZZ_INPUT") {
            check(&std::fs::read(input).expect("the input"));
            continue;
        }
        let mut mutator = Mutator {
            rng: Xoshiro256PlusPlus::seed_from_u64(seed),
            corpus: corpus(name),
        };
        mutator.corpus.iter().for_each(|input| check(input));
        let (mut count, mut slowest, mut most) = (0u64, Duration::ZERO, 0);
        let begin = Instant::now();
        while begin.elapsed().as_secs_f64() < seconds {
            let input = mutator.input();
            let keep = kept.join(format!("{name}-{count}"));
            let (from, memory) = (processor_time(), NOW.load(Ordering::Relaxed));
            MOST.store(memory, Ordering::Relaxed);
            SINCE.store(began.elapsed().as_millis().max(1) as u64, Ordering::Relaxed);
            *RUNNING.lock().expect("one thread writes it") = input.clone();
            let done = std::panic::catch_unwind(|| check(&input));
            SINCE.store(0, Ordering::Relaxed);
            let took = processor_time().saturating_sub(from);
            let peak = MOST.load(Ordering::Relaxed).saturating_sub(memory);
            count += 1;
            (slowest, most) = (slowest.max(took), most.max(peak));
            if done.is_err() || took > AT_MOST || peak > MEMORY {
                std::fs::write(&keep, &input).expect("room");
                panic!("{name}: {took:?}, {} MiB: {}", peak >> 20, keep.display());
            }
        }
        println!(
            "{name}: {count} inputs, {:.0} a second; the slowest {:.3} s, the largest {:.1} MiB; seed {seed}",
            count as f64 / begin.elapsed().as_secs_f64(),
            slowest.as_secs_f64(),
            most as f64 / f64::from(1 << 20)
        );
    }
    let _ = std::fs::remove_dir_all(targets::folder());
    assert!(ran > 0, "IMU_STAND_FUZZ_TARGET names none of them");
}
