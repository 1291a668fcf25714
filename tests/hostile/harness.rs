//! Runs a target on inputs in sequence, and checks the laws shared by all targets.

use std::{
    any::Any,
    fs,
    panic::{AssertUnwindSafe, catch_unwind},
    path::Path,
    time::{Duration, Instant},
};

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rustix::time::{ClockId, clock_gettime};
use tempfile::TempDir;

use crate::mutator::Mutator;

/// Limits of an input's processor time and memory.
const LONGEST: Duration = Duration::from_secs(2);
const MOST_BYTES: u64 = 256 << 20;

/// Outcome of an input: accepted or refused, or a broken law.
pub(crate) type Outcome = Result<bool, String>;

/// A folder in memory if the system has such a folder, for targets reading files.
pub(crate) fn scratch() -> TempDir {
    let memory = Path::new("/dev/shm");
    if memory.is_dir() { TempDir::new_in(memory) } else { TempDir::new() }.expect("folder")
}

fn processor_time() -> Duration {
    let now = clock_gettime(ClockId::ThreadCPUTime);
    Duration::new(now.tv_sec as u64, now.tv_nsec as u32)
}

fn seconds() -> u64 {
    std::env::var("BORESIGHT_FUZZ_SECS").ok().and_then(|secs| secs.parse().ok()).unwrap_or(1)
}

/// `BORESIGHT_FUZZ_SEED`: another number tries other inputs.
fn first_seed() -> u64 {
    std::env::var("BORESIGHT_FUZZ_SEED").ok().and_then(|seed| seed.parse().ok()).unwrap_or(0) << 32
}

/// Tries the corpus of the target `name`, then variations of good inputs by `generate`.
pub(crate) fn run(
    name: &str,
    mut generate: impl FnMut(&mut Mutator) -> Vec<u8>,
    mut check: impl FnMut(&[u8]) -> Outcome,
) {
    let corpus = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/hostile/corpus").join(name);
    let mut files: Vec<_> = fs::read_dir(&corpus)
        .into_iter()
        .flatten()
        .map(|entry| entry.expect("listable").path())
        .collect();
    files.sort();
    let mut tally = Tally::default();
    for file in files {
        let input = fs::read(&file).expect("readable");
        if let Some(why) = tally.hold(&input, &mut check) {
            panic!("{name}: {}: {why}", file.display());
        }
    }
    let until = Instant::now() + Duration::from_secs(seconds());
    let mut seed = first_seed();
    while Instant::now() < until {
        let input = generate(&mut Mutator::new(ChaCha8Rng::seed_from_u64(seed)));
        if let Some(why) = tally.hold(&input, &mut check) {
            let file = std::env::temp_dir().join(format!("hostile-{name}-{seed}"));
            fs::write(&file, &input).expect("written");
            panic!("{name}: seed {seed}: {why}; the input is in {}", file.display());
        }
        seed += 1;
    }
    println!(
        "{name}: {} inputs, {:.1} % accepted, at most {:.0} ms of the processor and {} kB",
        tally.tried,
        100.0 * tally.accepted as f64 / tally.tried.max(1) as f64,
        tally.longest.as_secs_f64() * 1e3,
        tally.most_bytes >> 10
    );
    // A slow machine tries too few to tell.
    if tally.tried > 500 {
        assert!(tally.accepted > 0, "{name}: nothing gets past the door");
        assert!(tally.accepted < tally.tried, "{name}: nothing is refused");
    }
}

#[derive(Default)]
struct Tally {
    tried: u64,
    accepted: u64,
    longest: Duration,
    most_bytes: u64,
}

impl Tally {
    /// Law broken by `input`, if any.
    fn hold(&mut self, input: &[u8], check: &mut impl FnMut(&[u8]) -> Outcome) -> Option<String> {
        let began = processor_time();
        let mut outcome = Ok(Ok(false));
        let memory = allocation_counter::measure(|| {
            outcome = catch_unwind(AssertUnwindSafe(|| check(input)));
        });
        let took = processor_time() - began;
        self.tried += 1;
        self.longest = self.longest.max(took);
        self.most_bytes = self.most_bytes.max(memory.bytes_max);
        match outcome {
            Err(panic) => return Some(format!("it panics: {}", words(panic.as_ref()))),
            Ok(Err(why)) => return Some(why),
            Ok(Ok(accepted)) => self.accepted += u64::from(accepted),
        }
        if took > LONGEST {
            return Some(format!("it takes {took:?}"));
        }
        (memory.bytes_max > MOST_BYTES).then(|| format!("it takes {} MB", memory.bytes_max >> 20))
    }
}

fn words(panic: &(dyn Any + Send)) -> String {
    let text = panic.downcast_ref::<String>().cloned();
    text.or_else(|| panic.downcast_ref::<&str>().map(|text| (*text).to_owned())).unwrap_or_default()
}

/// Debug text without quoted parts: a name may hold any word.
fn outside_quotes(text: &str) -> String {
    let (mut kept, mut is_quoted) = (String::with_capacity(text.len()), false);
    let mut letters = text.chars();
    while let Some(letter) = letters.next() {
        match letter {
            '\\' if is_quoted => drop(letters.next()),
            '"' => is_quoted = !is_quoted,
            _ if is_quoted => {}
            _ => kept.push(letter),
        }
    }
    kept
}

/// Refuses non-numbers anywhere in the debug text of accepted input.
pub(crate) fn only_numbers(what: &impl std::fmt::Debug) -> Result<(), String> {
    let text = outside_quotes(&format!("{what:?}"));
    for no_number in ["NaN", ": inf", " inf,", "[inf", "-inf", "(inf"] {
        if let Some(at) = text.find(no_number) {
            let from = text[..at].char_indices().rev().nth(80).map_or(0, |(from, _)| from);
            return Err(format!("no number: … {}{no_number}", &text[from..at]));
        }
    }
    Ok(())
}
