//! One trial on a real fleet: begin the epoch, open and close turns, collect the reports. Not here: an
//! interval of open mode (`open_play`), putting reports together (`reports`).

use super::answers::Mute;
use super::backend::{Backend, Clocked, PlayError, Played, PlayedOpen};
use super::fleet::{FleetOptions, RealFleet};
use super::inflict::Infliction;
use super::recovery::Recovery;
use super::reports::Reports;
use super::silence::Relieved;
use crate::supervision::watch::CraftEnded;
use agent::lockstep::Referee;
use shared_types::ids::CraftId;
use shared_types::knowledge::FleetNetwork;
use shared_types::time::Nanos;
use shared_types::transport::{Destination, clock};
use shared_types::wire::{EpochSpec, Header, Kind, RecoverySpec, Traffic, TurnCommand, TurnReport};
use zerocopy::{FromBytes, IntoBytes};

/// How long processes may take to report after a trial was given up, ns.
const GIVEN_UP_LIMIT_NS: u64 = 1_000_000_000;

impl Backend for RealFleet<'_> {
    fn play(&mut self, spec: &EpochSpec, network: &FleetNetwork) -> Result<Played, PlayError> {
        self.control = Traffic::default();
        self.begin(spec, network)?;
        let cpu_start = clock::process_cpu();
        let started = clock::now();
        self.note_ready(started);
        let mut trial = Trial::new(self, spec);
        let mut command = trial.referee.start();
        while let Some(next) = trial.turn(self, &command)? {
            command = next;
        }
        let Trial { referee, turn_times_ns, reports, .. } = trial;
        Ok(Played {
            outcome: referee.outcome().expect("invariant: the loop ends with the trial"),
            turns: referee.turns(),
            path_digest: referee.path_digest(),
            path: referee.path().to_vec(),
            reports: reports.into_received(),
            clock: Clocked {
                duration_ns: clock::now().since(started),
                turn_times_ns,
                orchestrator_cpu_ns: clock::process_cpu().since(cpu_start),
                control: self.control,
            },
            links: None,
        })
    }

    fn slow_down(&mut self, percent: u64) {
        self.planted_slowdown_percent = percent;
    }

    fn play_open(
        &mut self,
        spec: &EpochSpec,
        network: &FleetNetwork,
    ) -> Result<PlayedOpen, PlayError> {
        self.play_interval(spec, network)
    }

    fn inflict(&mut self, faults: Vec<Infliction>) {
        self.plan_faults(faults);
    }

    fn recover(&mut self, lost: Vec<CraftEnded>) -> Result<(), PlayError> {
        self.replace(lost)
    }

    fn take_recoveries(&mut self, all: bool) -> Vec<Recovery> {
        self.recoveries_over(all)
    }

    fn take_relieved(&mut self) -> Vec<Relieved> {
        self.relieved()
    }

    fn take_mute(&mut self) -> Vec<Mute> {
        std::mem::take(&mut self.mute)
    }

    fn ready_ns(&self) -> Option<u64> {
        self.ready_ns
    }
}

impl RealFleet<'_> {
    /// Brings every process that takes part to the point before the first turn.
    pub(super) fn begin(
        &mut self,
        spec: &EpochSpec,
        network: &FleetNetwork,
    ) -> Result<(), PlayError> {
        if self.network != Some(spec.network) {
            self.send(Destination::World, Kind::World, spec.network, &network.to_archive())?;
            self.network = Some(spec.network);
        }
        let lives = self.lives_given;
        let recovery = spec.recovery.map(|recovery| RecoverySpec { lives, ..recovery });
        let sent = EpochSpec { recovery, ..spec.clone() };
        let archive = rkyv::to_bytes::<rkyv::rancor::Error>(&sent)
            .expect("invariant: memory takes every archive");
        let processes = taking_part(self, spec);
        self.tell(spec, Kind::EpochBegin, &archive)?;
        self.await_all(Kind::EpochReady, spec.epoch, processes)?;
        shared_types::transport::Endpoint::update_connections(&mut self.endpoint)?;
        self.tell(spec, Kind::Connect, &[])?;
        self.await_all(Kind::Connected, spec.epoch, processes)?;
        self.note_rejoined(clock::now());
        Ok(())
    }

    /// Where a slowdown is planted: holds the turn that was opened at `opened` open for longer.
    fn hold_open(&self, opened: Nanos) {
        if self.planted_slowdown_percent > 0 {
            let now = clock::now();
            let until = now.plus(now.since(opened) * self.planted_slowdown_percent / 100);
            while clock::now() < until {
                std::hint::spin_loop();
            }
        }
    }
}

/// How many processes play: the centre only where the strategy has one.
pub(super) fn taking_part(fleet: &RealFleet<'_>, spec: &EpochSpec) -> u32 {
    fleet.options.crafts + u32::from(spec.strategy.has_centre())
}

/// A trial under way.
struct Trial {
    spec: EpochSpec,
    referee: Referee,
    turn_times_ns: Vec<u64>,
    reports: Reports,
    /// What a process sent that cannot be.
    fault: Option<String>,
}

impl Trial {
    fn new(fleet: &RealFleet<'_>, spec: &EpochSpec) -> Self {
        let processes = taking_part(fleet, spec) as usize;
        Self {
            spec: spec.clone(),
            referee: Referee::new(spec, fleet.options.crafts),
            turn_times_ns: Vec::with_capacity(spec.turns_max.min(10_000) as usize),
            reports: Reports::of(processes),
            fault: None,
        }
    }

    /// Gives one command and waits for the ledger's answer: the next command, `None` once the trial
    /// is over and every report is in.
    fn turn(
        &mut self,
        fleet: &mut RealFleet<'_>,
        command: &TurnCommand,
    ) -> Result<Option<TurnCommand>, PlayError> {
        let opened = clock::now();
        fleet.tell(&self.spec, Kind::TurnCommand, command.as_bytes())?;
        let FleetOptions { turn_limit_ns, answer_limit_ns, .. } = fleet.options;
        let limit_ns = if command.is_last == 0 { turn_limit_ns } else { answer_limit_ns };
        fleet.be_patient(limit_ns, opened);
        if let Some(turn) = command.opened() {
            fleet
                .strike_in_turn(turn, opened)
                .map_err(|error| PlayError::Failed(error.to_string()))?;
        }
        loop {
            fleet.pump(&mut |source, kind, header, payload| {
                if header.epoch == self.spec.epoch {
                    self.take(source, kind, header, payload);
                }
            })?;
            let next = self.referee.advance();
            if next.is_some() && command.opened().is_some() {
                fleet.hold_open(opened);
                self.turn_times_ns.push(clock::now().since(opened));
            }
            if next.is_some() || (self.referee.outcome().is_some() && self.reports.are_complete()) {
                return Ok(next);
            }
            if self.fault.is_some() || fleet.is_overdue() {
                return Err(self.give_up(fleet));
            }
        }
    }

    fn take(&mut self, source: CraftId, kind: Kind, header: &Header, payload: &[u8]) {
        match kind {
            Kind::TurnReport => {
                let Ok(report) = TurnReport::read_from_bytes(payload) else {
                    self.fault = Some(format!("process {source} sent half a turn report"));
                    return;
                };
                if let Err(error) = self.referee.record(source, &report) {
                    self.fault = Some(error.to_string());
                }
            }
            Kind::TrialReport => {
                if let Err(fault) = self.reports.take(source, header, payload) {
                    self.fault = Some(fault);
                }
            }
            _ => {}
        }
    }

    /// Asks everybody for the report of an unbalanced trial, so that it can be said where it broke.
    fn give_up(&mut self, fleet: &mut RealFleet<'_>) -> PlayError {
        let standing = self.fault.take().unwrap_or_else(|| self.referee.standing());
        let told = fleet.tell(&self.spec, Kind::EpochEnd, &[]);
        fleet.be_patient(GIVEN_UP_LIMIT_NS, clock::now());
        while told.is_ok() && !self.reports.are_complete() && !fleet.is_overdue() {
            let pumped = fleet.pump(&mut |source, kind, header, payload| {
                if header.epoch == self.spec.epoch && kind == Kind::TrialReport {
                    self.take(source, kind, header, payload);
                }
            });
            if let Err(error) = pumped {
                return error;
            }
        }
        let reports = std::mem::replace(&mut self.reports, Reports::of(0)).into_received();
        PlayError::Unbalanced { turns: self.referee.turns_opened(), standing, reports }
    }
}
