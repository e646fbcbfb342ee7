//! `simulate --campaign`, `--replay` and `--losses`: fleets under faults, on the virtual clock.

use super::{Refusal, Setting, print_bytes, print_report};
use crate::cli::SimulateArguments;
use crate::outcome::Outcome;
use crate::report::simulated::{Broken, LossRow, Losses, SimulatedCampaign, StrategyRow};
use agent::simulation::campaign::{Case, Failure, Fault, Play, Played, Stage, lossy};
use shared_types::transport::clock;
use shared_types::wire::StrategyKind;

/// Fleets that broke a law and are shown; the rest is counted.
const BROKEN_SHOWN: usize = 3;

/// Losses of the table, of a thousand samples.
const LOSSES: [u32; 5] = [0, 100, 250, 500, 750];

/// Fewest values beyond a quantile that is shown.
const BEYOND_MIN: u64 = 10;

/// Carries out what stands in for a scenario; `None` if nothing does.
///
/// # Errors
/// If a strategy plays no traces.
pub fn simulated(
    arguments: &SimulateArguments,
    setting: Setting,
) -> Option<Result<Outcome, Refusal>> {
    if arguments.replay {
        Some(replay(arguments))
    } else if let Some(seeds) = arguments.campaign {
        Some(campaign(arguments, seeds, setting))
    } else {
        arguments.losses.map(|seeds| losses(arguments, seeds, setting))
    }
}

/// What the fleets play.
const fn play(arguments: &SimulateArguments) -> Play {
    if arguments.lockstep { Play::Lockstep } else { Play::Open }
}

/// The strategies asked for, else `default`.
fn strategies(
    arguments: &SimulateArguments,
    default: &[StrategyKind],
) -> Result<Vec<StrategyKind>, Refusal> {
    let (asked, known) = (&arguments.run.common.strategies, play(arguments).strategies());
    if let Some(strategy) = asked.iter().find(|strategy| !known.contains(strategy)) {
        let known = known.iter().map(|known| known.name()).collect::<Vec<_>>().join(", ");
        return Err(Refusal::new(format!("`{strategy}` has no campaigns; take one of {known}")));
    }
    Ok(if asked.is_empty() { default.to_vec() } else { asked.clone() })
}

fn campaign(
    arguments: &SimulateArguments,
    seeds: u64,
    setting: Setting,
) -> Result<Outcome, Refusal> {
    let first_seed = arguments.run.common.seed.unwrap_or(0);
    let (mut rows, mut shown) = (Vec::new(), Vec::new());
    let mut stage = Stage::default();
    let play = play(arguments);
    for strategy in strategies(arguments, play.strategies())? {
        let (mut all, mut broken) = (Played::default(), 0);
        let started = clock::now();
        for seed in (first_seed..).take(usize::try_from(seeds).unwrap_or(usize::MAX)) {
            match Case::drawn(seed, strategy, play).judge(&mut stage) {
                Ok(played) => all += played,
                Err(failure) => {
                    broken += 1;
                    if shown.len() < BROKEN_SHOWN {
                        shown.push(broken_by(&failure));
                    }
                }
            }
        }
        let took_ns = clock::now().since(started).max(1);
        rows.push(StrategyRow {
            strategy: strategy.name(),
            seeds,
            broken,
            trials: all.trials,
            kills: all.kills,
            lost: all.lost,
            repeats: all.recovered.repeats,
            learnt: all.recovered.learnt,
            given_up: all.recovered.given_up,
            seeds_per_s: per_second(seeds, took_ns),
        });
    }
    let is_broken = rows.iter().any(|row| row.broken > 0);
    let is_lockstep = play == Play::Lockstep;
    let report = SimulatedCampaign { first_seed, is_lockstep, strategies: rows, broken: shown };
    print_report(&report, setting, arguments.run.common.all)?;
    Ok(if is_broken { Outcome::Broken } else { Outcome::Success })
}

#[expect(clippy::cast_precision_loss, reason = "counts and times stay far below 2^53")]
fn per_second(count: u64, took_ns: u64) -> f64 {
    count as f64 * 1e9 / took_ns as f64
}

fn broken_by(failure: &Failure) -> Broken {
    let lines = |faults: &[Fault]| faults.iter().map(ToString::to_string).collect();
    Broken {
        strategy: failure.case.strategy.name(),
        seed: failure.case.seed,
        law: failure.violation.to_string(),
        faults: lines(&failure.case.faults),
        minimal: lines(&failure.minimal),
    }
}

/// Shows one fleet step by step; of one that breaks a law, what suffices for it.
fn replay(arguments: &SimulateArguments) -> Result<Outcome, Refusal> {
    let strategies = strategies(arguments, &[StrategyKind::Boundary])?;
    let [strategy] = strategies[..] else {
        return Err(Refusal::new("a replay shows one fleet; name one `--strategy`"));
    };
    let mut stage = Stage::default();
    let seed = arguments.run.common.seed.unwrap_or(0);
    let mut case = Case::drawn(seed, strategy, play(arguments));
    if let Err(failure) = case.clone().judge(&mut stage) {
        case.faults = failure.minimal;
    }
    let plays = match case.play {
        Play::Open => format!("{} writes", case.scene.trace.iter().map(Vec::len).sum::<usize>()),
        Play::Lockstep => "trials in lockstep".to_owned(),
    };
    let mut text = format!("{strategy}, seed {seed}: {} crafts, {plays}\n", case.scene.crafts());
    for fault in &case.faults {
        text += &format!("  {fault}\n");
    }
    let played = case.play(
        &mut stage,
        Some(&mut |at, what| text += &format!("{:>10} us  {what}\n", at.0 / 1_000)),
    );
    match &played {
        Ok(played) => {
            text += &format!(
                "quiet after {} us; every law held; {} lost, {} repeated, {} learnt from states\n",
                played.duration_ns / 1_000,
                played.lost,
                played.recovered.repeats,
                played.recovered.learnt
            );
        }
        Err(violation) => text += &format!("broken: {violation}\n"),
    }
    print_bytes(text.as_bytes())?;
    Ok(if played.is_ok() { Outcome::Success } else { Outcome::Broken })
}

fn losses(arguments: &SimulateArguments, seeds: u64, setting: Setting) -> Result<Outcome, Refusal> {
    let first = arguments.run.common.seed.unwrap_or(0);
    let mut rows = Vec::new();
    let mut stage = Stage::default();
    for strategy in strategies(arguments, &[StrategyKind::Boundary])? {
        for permille in LOSSES {
            let range = first..first.saturating_add(seeds);
            let lossy = match lossy(strategy, permille, range, &mut stage) {
                Ok(lossy) => lossy,
                Err((seed, violation)) => {
                    eprintln!("{strategy} at {permille} of 1000 lost, seed {seed}: {violation}");
                    return Ok(Outcome::Broken);
                }
            };
            let known = &lossy.knowledge_ns;
            #[expect(clippy::cast_precision_loss, reason = "times stay far below 2^53")]
            let quantile = |of_thousand: u64| {
                let has_enough = known.len() * (1_000 - of_thousand) / 1_000 >= BEYOND_MIN;
                let value = known.value_at_quantile(of_thousand as f64 / 1_000.0);
                has_enough.then_some(value as f64 / 1_000.0)
            };
            rows.push(LossRow {
                strategy: strategy.name(),
                loss_percent: f64::from(permille) / 10.0,
                needed: lossy.needed,
                delivered: lossy.applied,
                p50_us: quantile(500),
                p99_us: quantile(990),
                first_samples: lossy.played.first_sent.transmissions,
                first_bytes: lossy.played.first_sent.bytes_sent,
                further_samples: lossy.played.on_top.transmissions,
                further_bytes: lossy.played.on_top.bytes_sent,
            });
        }
    }
    print_report(&Losses { seeds, rows }, setting, arguments.run.common.all)
}
