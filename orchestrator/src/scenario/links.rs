//! Checks of `[link]`: bounds of every number, and whom an outage is about.

use super::error::{Finding, Place, place};
use super::fleet::Craft;
use super::validate::{above_zero, check_craft};
use shared_types::limits::{
    BANDWIDTH_BITS_PER_S_MAX, DELAY_MS_MAX, LOSS_MAX, OUTAGES_MAX, RANGE_M_MAX,
    SPEED_OF_LIGHT_M_PER_S,
};
use shared_types::scenario::{Link, Outage};

/// Checks what a scenario says of its links.
pub(super) fn check(link: &Link, crafts: &[Craft]) -> Result<(), Finding> {
    if !(0.0..=LOSS_MAX).contains(&link.loss) {
        return Err(out_of_bounds("loss", format!("a loss of {} is impossible", link.loss)).help(
            format!(
                "loss is a share: 0 loses nothing, 0.05 five in a hundred; of more than {LOSS_MAX} \
                 repeats, which are bounded, do not get through"
            ),
        ));
    }
    if !(0.0..=1.0).contains(&link.duplication) {
        let message = format!("a duplication of {} is impossible", link.duplication);
        return Err(out_of_bounds("duplication", message)
            .help("it is a share: 0 doubles nothing, 0.05 five in a hundred, 1 everything"));
    }
    for (key, what, ms) in
        [("delay-ms", "delay", link.delay_ms), ("jitter-ms", "jitter", link.jitter_ms)]
    {
        if !(0.0..=DELAY_MS_MAX).contains(&ms) {
            return Err(out_of_bounds(key, format!("a {what} of {ms} ms is impossible"))
                .help(format!("use 0 to {DELAY_MS_MAX} ms")));
        }
    }
    if let Some(bandwidth) = link.bandwidth_bits_per_s {
        let place = place!["link", "bandwidth-bits-per-s"];
        above_zero(place, "bandwidth", bandwidth, BANDWIDTH_BITS_PER_S_MAX, "bits per second")?;
    }
    if let Some(positions) = &link.from_positions {
        let place = place!["link", "from-positions"];
        above_zero(place.then("range-m"), "range", positions.range_m, RANGE_M_MAX, "metres")?;
        let speed = positions.propagation_m_per_s;
        above_zero(
            place.then("propagation-m-per-s"),
            "speed",
            speed,
            SPEED_OF_LIGHT_M_PER_S,
            "metres per second",
        )?;
    }
    if link.outages.len() > OUTAGES_MAX {
        let count = link.outages.len();
        return Err(Finding::at(place!["link", "outages"], format!("{count} outages"))
            .help(format!("use {OUTAGES_MAX} at most: one may cut off several crafts")));
    }
    for (index, outage) in link.outages.iter().enumerate() {
        check_outage(outage, &place!["link", "outages", index], crafts)?;
    }
    Ok(())
}

fn out_of_bounds(key: &'static str, message: String) -> Finding {
    Finding::at(place!["link", key], message).label("out of bounds")
}

fn check_outage(outage: &Outage, place: &Place, crafts: &[Craft]) -> Result<(), Finding> {
    match (&outage.craft, &outage.between) {
        (Some(cut_off), None) => {
            if cut_off.is_empty() {
                return Err(Finding::at(place.then("craft"), "an outage of nobody")
                    .help("name at least one craft"));
            }
            for name in cut_off.iter() {
                check_craft(name, place, crafts)?;
            }
        }
        (None, Some([one, other])) => {
            for name in [one, other] {
                check_craft(name, place, crafts)
                    .map_err(|finding| Finding { place: place.then("between"), ..finding })?;
            }
            if one == other {
                let message = format!("`{one}` has no link to itself");
                return Err(Finding::at(place.then("between"), message)
                    .help("name two crafts, or use `craft` to cut one off"));
            }
        }
        (Some(_), Some(_)) => {
            return Err(Finding::at(place.then("between"), "an outage of a craft and of a link")
                .help("leave out `craft` or `between`; two outages may act at once"));
        }
        (None, None) => {
            return Err(Finding::at(place.clone(), "an outage of nobody").help(
                "say who is cut off from all others, `craft = [\"a\", \"b\"]`, or which link is, \
                 `between = [\"a\", \"b\"]`",
            ));
        }
    }
    for (key, ms) in [("from-ms", outage.from_ms), ("until-ms", outage.until_ms)] {
        if !(0.0..=DELAY_MS_MAX).contains(&ms) {
            return Err(Finding::at(place.then(key), format!("a time of {ms} ms is impossible"))
                .help(format!("use 0 to {DELAY_MS_MAX} ms, counted from the start of a trial"))
                .label("out of bounds"));
        }
    }
    if outage.from_ms >= outage.until_ms {
        return Err(Finding::at(place.then("until-ms"), "the outage ends before it begins")
            .help(format!("use more than `from-ms`, which is {}", outage.from_ms)));
    }
    Ok(())
}
