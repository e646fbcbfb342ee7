//! The two processes, their run in shared memory, and the loop that is timed.

use super::exchange::{ExchangeError, Side, network};
use crate::raw::RawError;
use crate::raw::area::AreaName;
use crate::raw::child::Child;
use crate::raw::command::Exchanges;
use crate::raw::fleet::{self, Shared};
use hdrhistogram::Histogram;
use orchestrator::launch::run_root::{RunRoot, clean_dead_runs};
use shared_types::ids::{CraftId, Incarnation};
use shared_types::transport::iceoryx::{
    EndpointOptions, HostOptions, IceoryxEndpoint, IceoryxHost,
};
use shared_types::transport::{RunPaths, WakeMode, clock};
use std::fmt::Display;

/// Two crafts and room for a centre, as in every run.
const PROCESSES: u32 = 3;

/// Measures one-way latency; returns the times in ns. `area` keeps measurements apart; the run
/// itself lies where the product's runs do.
///
/// # Errors
/// If a child fails, a signal arrives, or the system refuses.
pub fn measure(area: &AreaName) -> Result<Histogram<u64>, RawError> {
    fleet::measure(area, 2, || {
        // What a killed predecessor left goes first, as at every start of the product.
        clean_dead_runs(RunPaths::new(0).base()).map_err(refused("clean dead runs"))?;
        let root = RunRoot::create().map_err(refused("make a run"))?;
        let host = IceoryxHost::create(root.paths(), HostOptions::new(PROCESSES))
            .map_err(refused("create the services"))?;
        // Services go before the root that they lie in.
        let knowledge = root.run().to_string();
        Ok(Shared { held: (host, root), knowledge })
    })
}

/// Takes part as child `index` of two, and reports to the parent.
///
/// # Errors
/// If the parent, the peer or the transport fails, or a write was not applied.
pub fn take_part(mut child: Child, index: u32, exchanges: Exchanges) -> Result<(), RawError> {
    let run = child.await_opening()?;
    let run = run.parse().map_err(|_| RawError::Unexpected(format!("run {run:?}")))?;
    let networks = network();
    let fleet = networks.view();
    let endpoint = IceoryxEndpoint::open(
        &RunPaths::new(run),
        CraftId(index),
        Incarnation(0),
        EndpointOptions::new(PROCESSES, WakeMode::Poll),
    )
    .map_err(refused("open the endpoint"))?;
    let mut side = Side::new(CraftId(index), &fleet, endpoint).map_err(failed)?;
    child.await_peers()?;
    side.connect().map_err(failed)?;
    child.await_start()?;
    let times = play(&mut side, index, exchanges).map_err(failed)?;
    side.check(exchanges.warm_up + exchanges.measured).map_err(failed)?;
    child.finish(&times)
}

/// Writes there and back; craft 0 records half of each round trip.
fn play(
    side: &mut Side<'_, IceoryxEndpoint>,
    index: u32,
    Exchanges { warm_up, measured }: Exchanges,
) -> Result<Histogram<u64>, ExchangeError> {
    let mut times = crate::raw::empty_histogram();
    for number in 0..warm_up + measured {
        let (there, back) = (2 * number, 2 * number + 1);
        if index == 0 {
            let begun = clock::now();
            side.write(begun, there, clock::now)?;
            await_applied(side, back)?;
            let round_trip_ns = clock::now().since(begun);
            if number >= warm_up {
                times.saturating_record(round_trip_ns / 2);
            }
        } else {
            let applied = await_applied(side, there).map(|()| clock::now())?;
            side.write(applied, back, clock::now)?;
        }
    }
    Ok(times)
}

/// Polls until the delta of `turn` has arrived, and merges it.
fn await_applied(side: &mut Side<'_, IceoryxEndpoint>, turn: u32) -> Result<(), ExchangeError> {
    while side.take()? == 0 {
        side.idle()?;
        std::thread::yield_now();
    }
    side.apply(turn);
    Ok(())
}

fn refused<E: Display>(operation: &'static str) -> impl FnOnce(E) -> RawError {
    move |error| RawError::Measured(format!("{operation}: {error}"))
}

fn failed(error: ExchangeError) -> RawError {
    RawError::Measured(error.to_string())
}
