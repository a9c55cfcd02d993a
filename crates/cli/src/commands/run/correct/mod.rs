//! `imu-stand run --correct`: record, diagnose, correct the board, record again under another history, compare, diagnose
//! again. What is done over the link is the same for a real board and a simulated one; what a simulated stand knows of
//! itself, which is the limit and the true rates, is beside it.

mod answer;
mod stages;

use std::path::{Path, PathBuf};

use diagnosis::DiagnoseOptions;
use diagnosis::result::Diagnosis;
use imu_stand::capture::{ReadOptions, corrected, read_capture};
use imu_stand::correct::{
    HEATER_S, Needed, Noise, Proposed, Stage, Taken, judge, keep_what_is_worth_it, needed, record,
};
use imu_stand::link::{DEFAULT_BAUD, Link};
use imu_stand::stand::planted::{compare, planted};
use imu_stand::stand::{Board, Plan, Simulated, another_history, without_defects, without_errors};
use indicatif::ProgressBar;
use miette::Result;
use model::ModelFile;
use model::record::Record;

use super::super::outputs;
use super::super::progress::beside_bar;
use super::{Arguments, Outputs};
use answer::{Answer, Recorded, corrected_causes};
use stages::{BEGIN_S, Length, Planned, REST_S};

/// Causes that a stand shows only while it turns: they are taken from the record of its sway.
const OF_TURNS: [&str; 2] = ["cross_axis", "scale_error"];

/// The first record becomes so many times as long as was asked for, at the most, where nobody says how long.
const LONGEST_TIMES: f64 = 12.0;
/// It is taken again so often at the most: once as long as the first look needs, and once more by what that shows.
const MOST_AGAIN: usize = 2;

/// The files of the loop: beside `run.csv` run-sway.csv, run-corrected.csv, run-corrected-sway.csv and run.toml.
struct Files {
    /// Captures of the first history and of the second one: at rest, swaying.
    captures: [[PathBuf; 2]; 2],
    model: PathBuf,
}

impl Files {
    fn of(out: &Path) -> Self {
        let name = super::super::name(out);
        let (stem, ending) = name.split_once('.').unwrap_or((&name, "csv"));
        let beside = |more: &str| out.with_file_name(format!("{stem}{more}.{ending}"));
        Self {
            captures: [
                [out.to_owned(), beside("-sway")],
                [beside("-corrected"), beside("-corrected-sway")],
            ],
            model: out.with_file_name(format!("{stem}.toml")),
        }
    }

    fn check(&self, arguments: &Arguments) -> Result<()> {
        let mut outputs = Outputs::beside(&arguments.correct_by);
        for capture in self.captures.iter().flatten() {
            outputs = outputs.simulated("--out", Some(capture))?;
        }
        outputs
            .result("--out", Some(&self.model))?
            .result("--json", arguments.json.as_ref())
            .map(drop)
    }
}

/// Where the board is.
enum Bench<'a> {
    /// On a port. Nobody knows its stand.
    Port(Box<Link>),
    /// Simulated, on the stand of the plan.
    Simulated(&'a Board, &'a Plan),
}

/// A diagnosis and the model of it.
struct Found {
    diagnosis: Diagnosis,
    model: ModelFile,
}

/// What a simulated stand knows of itself.
struct Known {
    limit: Vec<Taken>,
    truth: Option<Vec<Taken>>,
}

impl Known {
    fn truth(&self, record: usize) -> Option<&Record> {
        self.truth.as_ref().map(|truth| &truth[record].record)
    }
}

/// What the first history tells.
struct First {
    planned: Planned,
    found: Vec<Found>,
    recorded: Recorded,
}

struct Loop<'a> {
    arguments: &'a Arguments,
    files: Files,
    bar: ProgressBar,
}

/// Runs it.
pub fn run(arguments: &Arguments, bar: ProgressBar) -> Result<()> {
    let files = Files::of(&arguments.out);
    files.check(arguments)?;
    let whole = Loop {
        arguments,
        files,
        bar,
    };
    if arguments.line.is_named() {
        let link = arguments.line.open()?;
        return whole.run(Bench::Port(Box::new(link)));
    }
    let board = super::board(arguments)?;
    let plan = super::planned(arguments)?;
    whole.run(Bench::Simulated(&board, &plan))
}

/// A simulated board on a line.
fn simulated(board: &Board, scenario: bench::Scenario) -> Link {
    let port = Simulated::start(board.clone(), scenario);
    Link::over(Box::new(port), "the simulated board", DEFAULT_BAUD)
}

impl Loop<'_> {
    fn run(&self, bench: Bench<'_>) -> Result<()> {
        let seeds = super::seeds(self.arguments);
        // Another history than the noise's own.
        let again = seeds.noise ^ 0x7365_636f_6e64;
        let sways =
            matches!(&bench, Bench::Simulated(_, plan) if plan.run.scenario.base.sway_deg != 0.0);
        let seconds = self.arguments.seconds;
        let planned = Planned::new(Length::First(seconds), sways, seeds.fault);
        let second = Planned::new(Length::Second(seconds), sways, again);

        let (mut link, scenarios) = match bench {
            Bench::Port(link) => (*link, None),
            Bench::Simulated(board, plan) => {
                let one = planned.scenario(&plan.run.scenario);
                let two = second.scenario(&another_history(&plan.run.scenario, again));
                (simulated(board, one), Some((board, plan, two)))
            }
        };
        let stand = scenarios.as_ref().map(|(board, plan, _)| (*board, *plan));
        let First {
            planned: first,
            found,
            recorded,
        } = self.first(&mut link, planned, stand)?;
        let mut model = model_of(&found)?;
        let refused = keep_what_is_worth_it(&mut model);
        super::super::write(&self.files.model, &model.to_toml())?;
        let (model, refused) = match &self.arguments.correct_by {
            Some(path) => (super::super::read_model(path)?, Vec::new()),
            None => (model, refused),
        };

        // The same parts: another history of the simulated stand, or the same board a while later.
        if let Some((board, _, two)) = &scenarios {
            link = simulated(board, two.clone());
        }
        let mut proposed = Proposed::of(&mut link, &model)?.map_err(|error| {
            miette::miette!(
                help = "nothing was written; docs/wire-format.md lists what the board holds",
                "the model of the first record: {error}"
            )
        })?;
        proposed.write(&mut link)?;
        proposed.board.notes.extend(refused);
        let mut taken = self.take(&mut link, &second, second.courses.len())?;
        drop(link);
        self.write(&mut taken, 1, scenarios.is_some())?;
        let known = (scenarios.as_ref())
            .map(|(board, _, two)| self.known(board, &second, two, &model, seeds.stand))
            .transpose()?;
        let mut noise = Noise::of_model(&model);
        for (noise, block) in noise.iter_mut().zip(proposed.board.correction.noise) {
            noise.block = block;
        }
        let judged: Vec<_> = (taken.iter().zip(&second.courses).enumerate())
            .map(|(k, (taken, (what, _)))| {
                let stage = Stage {
                    what,
                    record: &taken.record,
                    corrected: &taken.corrected,
                    rest_s: second.rest_s(k),
                    noise: &noise,
                    truth: known.as_ref().and_then(|known| known.truth(k)),
                    limit: known.as_ref().map(|known| &known.limit[k].record),
                };
                judge(&stage, self.arguments.replicates.matters())
            })
            .collect();
        let again = self.diagnose(1, taken.len())?;
        let comparison = scenarios.as_ref().map(|(_, plan, _)| {
            let mut both = found[0].diagnosis.clone();
            both.findings.extend(of_turns(&found));
            let run = first.run(&plan.run);
            compare(&planted(&run, BEGIN_S), &both)
        });
        let answer = Answer::new(
            &model,
            proposed,
            recorded,
            judged,
            comparison,
            found.into_iter().map(|f| f.diagnosis).collect(),
            again.iter().map(|f| f.diagnosis.clone()).collect(),
        );
        super::super::write_json(self.arguments.json.as_ref(), &answer)?;
        self.say(&answer);
        Ok(())
    }

    /// Takes the first history and diagnoses it; its record at rest again, as long as the one before it asks for.
    fn first(
        &self,
        link: &mut Link,
        mut planned: Planned,
        stand: Option<(&Board, &Plan)>,
    ) -> Result<First> {
        let mark = stand.is_some();
        let all = planned.courses.len();
        let mut taken = self.take(link, &planned, all)?;
        self.write(&mut taken, 0, mark)?;
        let mut found = self.diagnose(0, all)?;
        let mut recorded = Recorded::new(self.arguments.seconds);
        // A longer record may name what needs one longer still.
        for _ in 0..MOST_AGAIN {
            let Some(longer) = self.longer(&taken[0], &found, &mut recorded) else {
                break;
            };
            planned = planned.again(longer, recorded.heater_s);
            if let Some((board, plan)) = stand {
                *link = simulated(board, planned.scenario(&plan.run.scenario));
            }
            // What the sway tells is known already.
            let mut again = self.take(link, &planned, 1)?;
            self.write(&mut again, 0, mark)?;
            found.splice(..1, self.diagnose(0, 1)?);
            recorded.left = self.too_short(&again[0], &found);
            taken.splice(..1, again);
        }
        Ok(First {
            planned,
            found,
            recorded,
        })
    }

    /// How long the first record has to be when it is taken again, s, as far as the user lets it: as the coefficients need, and as
    /// long as the second one, for what that can show is to be in the model. A slope over temperature wants a heater.
    fn longer(&self, rest: &Taken, found: &[Found], recorded: &mut Recorded) -> Option<f64> {
        let causes = corrected_causes(&found.first()?.model);
        if self.arguments.correct_by.is_some() || causes.is_empty() {
            return None;
        }
        let (asked_s, before_s) = (self.arguments.seconds, recorded.seconds);
        let needed = self.too_short(rest, found);
        let wanted = needed.as_ref().map_or(0.0, |needed| needed.seconds);
        let longest = self.arguments.longest.unwrap_or(LONGEST_TIMES * asked_s);
        let second_s = Length::Second(asked_s).seconds();
        let seconds = wanted.max(second_s).min(longest);
        if recorded.needed.is_none() || seconds > before_s {
            (recorded.needed, recorded.needed_by_s) = (needed, before_s);
        }
        if seconds <= before_s {
            return None;
        }
        // A slope over temperature that this one does not show may be among what is to be known.
        (recorded.seconds, recorded.heater_s) = (seconds, Some(HEATER_S));
        Some(seconds)
    }

    /// What a record at rest is too short for.
    fn too_short(&self, rest: &Taken, found: &[Found]) -> Option<Needed> {
        let second_s = Length::Second(self.arguments.seconds).seconds();
        let judged_s = [REST_S, second_s - REST_S];
        needed(
            &rest.record,
            &Noise::of_model(&found.first()?.model),
            judged_s,
        )
    }

    /// The first so many records of a history.
    fn take(&self, link: &mut Link, planned: &Planned, count: usize) -> Result<Vec<Taken>> {
        let mut all = Vec::new();
        self.bar.set_length(planned.end_s() as u64);
        for (_, course) in planned.courses.iter().take(count) {
            let bar = &self.bar;
            let from = course.from.as_secs_f64();
            // That of the simulated stand is switched by its own clock.
            let half_s = planned.heater_s.filter(|_| self.arguments.line.is_named());
            let mut switched = 0;
            let taken = record(link, course, |t| {
                bar.set_position((from + t.max(0.0)) as u64);
                let Some(half_s) = half_s else { return };
                let half = (t / half_s).floor() as i64 + 1;
                if half > switched {
                    switched = half;
                    self.prompt(half % 2 == 1, half_s);
                }
            });
            all.push(taken?);
        }
        self.bar.reset();
        Ok(all)
    }

    /// Asks for the heater, of whoever is there: nothing waits for it.
    fn prompt(&self, on: bool, half_s: f64) {
        if self.arguments.quiet {
            return;
        }
        let (word, minutes) = (if on { "on" } else { "off" }, half_s / 60.0);
        self.bar.suspend(|| {
            say!(
                "switch the heater {word} if there is one, for {minutes:.0} minutes; a hair dryer on a timer will do"
            );
        });
    }

    fn write(&self, taken: &mut [Taken], history: usize, mark: bool) -> Result<()> {
        for (taken, path) in taken.iter_mut().zip(&self.files.captures[history]) {
            if mark {
                outputs::mark_simulated(&mut taken.record, "run");
            }
            outputs::write_record(path, &taken.record)?;
        }
        Ok(())
    }

    /// Diagnoses the captures of a history as they were written; of the second one the corrected rates.
    fn diagnose(&self, history: usize, count: usize) -> Result<Vec<Found>> {
        let captures = self.files.captures[history].iter().take(count);
        captures
            .map(|path| {
                let mut record = read_capture(path, &ReadOptions::default())?.record;
                if history == 1 {
                    record = corrected(record)?;
                }
                let options = DiagnoseOptions {
                    seed: self.arguments.seed,
                    file: super::super::name(path),
                    hash: Some(super::super::digest(path)?),
                    no_evidence: true,
                    replicates: self.arguments.replicates.count(),
                    matters: self.arguments.replicates.matters(),
                };
                let say = || format!("diagnosing {}", options.file);
                let found = beside_bar(self.arguments.quiet, say, || {
                    diagnosis::diagnose(&record, &options)
                });
                let found = found.map_err(super::super::explain)?;
                Ok(Found {
                    model: found.extended_model.clone().excited_like(&record),
                    diagnosis: found.diagnosis,
                })
            })
            .collect()
    }

    /// What the bench knows: the second history on a stand with nothing wrong, whose board was told its noise, and, where the
    /// base moves, the true rates.
    fn known(
        &self,
        board: &Board,
        planned: &Planned,
        scenario: &bench::Scenario,
        model: &ModelFile,
        stand: u64,
    ) -> Result<Known> {
        let sound = without_defects(scenario, stand);
        // On the same board: another one samples at other instants, which is another noise.
        let mut link = simulated(board, sound.clone());
        Proposed::of(&mut link, &perfect(model, &sound))?
            .map_err(|error| miette::miette!("the noise of the stand itself: {error}"))?
            .write(&mut link)?;
        let limit = self.take(&mut link, planned, planned.courses.len())?;
        drop(link);
        let moves = sound.base.sway_deg != 0.0 || !sound.faults.is_empty();
        let exact = || {
            let mut link = simulated(&Board::Native, without_errors(scenario, stand));
            self.take(&mut link, planned, planned.courses.len())
        };
        let truth = moves.then(exact).transpose()?;
        Ok(Known { limit, truth })
    }

    fn say(&self, answer: &Answer) {
        self.bar.finish_and_clear();
        if self.arguments.quiet {
            return;
        }
        if let Some(comparison) = &answer.planted {
            say!("planted and found");
            comparison
                .lines()
                .iter()
                .for_each(|line| say!("    {line}"));
        }
        answer.lines().iter().for_each(|line| say!("{line}"));
    }
}

/// The model of the record at rest, with what the sway showed of how the axes stand.
fn model_of(found: &[Found]) -> Result<ModelFile> {
    let Some((rest, sways)) = found.split_first() else {
        miette::bail!(help = "record for longer", "there is no record");
    };
    let mut model = rest.model.clone();
    for sway in sways {
        let effects = sway.model.effects.iter();
        let turns = effects.filter(|e| OF_TURNS.contains(&e.cause.as_str()));
        model.effects.extend(turns.cloned());
    }
    Ok(model)
}

/// What a perfect diagnosis would say of a stand with nothing wrong: its noise and its biases, in the world of `model`.
fn perfect(model: &ModelFile, sound: &bench::Scenario) -> ModelFile {
    let mut perfect = ModelFile {
        excitation: model.excitation.clone(),
        ..ModelFile::paper()
    };
    for (channel, gyro) in perfect.channels.iter_mut().zip(&sound.gyros) {
        for (key, value) in [
            ("bias", gyro.turn_on_bias_dps),
            ("angle_random_walk", gyro.angle_random_walk_deg_sqrt_h),
            ("rate_random_walk", gyro.rate_random_walk),
        ] {
            if let Some(parameter) = channel.baseline.get_mut(key) {
                parameter.value = value;
            }
        }
    }
    perfect
}

fn of_turns(found: &[Found]) -> impl Iterator<Item = diagnosis::result::Finding> {
    let sways = found.iter().skip(1).flat_map(|f| &f.diagnosis.findings);
    sways
        .filter(|finding| OF_TURNS.contains(&finding.cause.as_str()))
        .cloned()
}
