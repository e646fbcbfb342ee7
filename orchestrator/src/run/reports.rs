//! Puts the trial reports of a fleet together: each comes as an archive in one or several parts.

use rkyv::util::AlignedVec;
use shared_types::ids::CraftId;
use shared_types::wire::{ArchivedTrialReport, Header, TrialReport};

/// The report of one process on its way.
#[derive(Debug, Default)]
struct Slot {
    parts: u32,
    archive: AlignedVec<16>,
    report: Option<TrialReport>,
}

/// The reports of a fleet.
#[derive(Debug)]
pub(crate) struct Reports {
    slots: Vec<Slot>,
    missing: usize,
}

impl Reports {
    /// Those of `processes` processes, none of which has come.
    pub(crate) fn of(processes: usize) -> Self {
        Self { slots: (0..processes).map(|_| Slot::default()).collect(), missing: processes }
    }

    /// Whether every report is there.
    pub(crate) const fn are_complete(&self) -> bool {
        self.missing == 0
    }

    /// Takes a part of the report of `source`; says whether that completed it.
    ///
    /// # Errors
    /// Says from whom it is, if a part is missing or the archive is damaged.
    pub(crate) fn take(
        &mut self,
        source: CraftId,
        header: &Header,
        payload: &[u8],
    ) -> Result<bool, String> {
        let slot = self
            .slots
            .get_mut(source.index())
            .ok_or_else(|| format!("process {source}, which has no part in this, sent a report"))?;
        if slot.report.is_some() || header.argument != slot.parts {
            return Err(format!("process {source} sent the parts of its report out of order"));
        }
        slot.parts += 1;
        slot.archive.extend_from_slice(payload);
        if slot.parts < header.firing_number {
            return Ok(false);
        }
        let archive = std::mem::take(&mut slot.archive);
        let report = read(&archive)
            .filter(|report| report.can_be_of(source))
            .ok_or_else(|| format!("process {source} sent a damaged trial report"))?;
        slot.report = Some(report);
        self.missing -= 1;
        Ok(true)
    }

    /// Those that have come, by process.
    pub(crate) fn into_received(self) -> Vec<TrialReport> {
        self.slots.into_iter().filter_map(|slot| slot.report).collect()
    }
}

/// Reads a report's archive; `None` if it is damaged.
fn read(archive: &[u8]) -> Option<TrialReport> {
    let archived = rkyv::access::<ArchivedTrialReport, rkyv::rancor::Error>(archive).ok()?;
    rkyv::deserialize::<TrialReport, rkyv::rancor::Error>(archived).ok()
}

#[cfg(test)]
mod tests {
    use super::Reports;
    use shared_types::ids::CraftId;
    use shared_types::wire::{Class, Header, Kind, OpenReport, TrialReport};

    fn part(number: u32, count: u32) -> Header {
        let mut header = Header::new(Class::Telemetry, Kind::TrialReport);
        (header.argument, header.firing_number) = (number, count);
        header
    }

    fn archive(craft: u32) -> rkyv::util::AlignedVec {
        let report = TrialReport { craft, resident_bytes: 7, ..TrialReport::default() };
        rkyv::to_bytes::<rkyv::rancor::Error>(&report).unwrap()
    }

    #[test]
    fn parts_of_several_processes_may_alternate() {
        let mut reports = Reports::of(2);
        let archives = [archive(0), archive(1)];
        let halves = archives.each_ref().map(|archive| archive.split_at(10));
        for (craft, (first, _)) in (0..).zip(halves) {
            assert_eq!(reports.take(CraftId(craft), &part(0, 2), first), Ok(false));
        }
        assert!(!reports.are_complete());
        for (craft, (_, second)) in (0..).zip(halves) {
            assert_eq!(reports.take(CraftId(craft), &part(1, 2), second), Ok(true));
        }
        assert!(reports.are_complete());
        let crafts: Vec<u32> = reports.into_received().iter().map(|report| report.craft).collect();
        assert_eq!(crafts, [0, 1]);
    }

    #[test]
    fn a_report_in_the_name_of_another_or_beyond_all_measure_is_damaged() {
        let mut report = TrialReport { craft: 1, ..TrialReport::default() };
        let take = |report: &TrialReport, source: u32| {
            let archive = rkyv::to_bytes::<rkyv::rancor::Error>(report).unwrap();
            Reports::of(2).take(CraftId(source), &part(0, 1), &archive)
        };
        assert_eq!(take(&report, 1), Ok(true));
        assert!(take(&report, 0).unwrap_err().contains("process 0 sent a damaged"));
        report.counters.losses.links.overtaken = u64::MAX;
        assert!(take(&report, 1).is_err());
        report.counters.losses.links.overtaken = 7;
        report.open = Some(OpenReport { applied_from: vec![1 << 60], ..OpenReport::default() });
        assert!(take(&report, 1).is_err());
    }

    #[test]
    fn a_missing_part_a_stranger_and_damage_are_named() {
        let mut reports = Reports::of(1);
        assert!(reports.take(CraftId(0), &part(1, 2), &[]).unwrap_err().contains("out of order"));
        assert!(reports.take(CraftId(3), &part(0, 1), &[]).unwrap_err().contains("process 3"));
        let damaged = reports.take(CraftId(0), &part(0, 1), &archive(0)[..20]);
        assert!(damaged.unwrap_err().contains("damaged"));
    }
}
