//! Who lives, and what follows for numbers when somebody is gone or back.

use super::Recovery;
use super::peer::Peer;
use shared_types::ids::CraftId;

impl Recovery {
    /// `craft` lives its life `incarnation` from now on; says whether that is news.
    pub(in crate::craft) fn up(&mut self, craft: CraftId, incarnation: u32) -> bool {
        let Some(peer) = self.peers.get_mut(craft.index()) else { return false };
        if craft == self.own
            || incarnation < peer.life
            || (incarnation == peer.life && !peer.is_gone)
        {
            return false;
        }
        // Lives are numbered across the fleet: one that is older than the epoch, or than this process, was
        // there before anything was sent, so whatever was sent was sent to it and is still to be confirmed.
        if !peer.is_gone && (incarnation <= self.lives || incarnation < self.life) {
            peer.life = incarnation;
            return false;
        }
        let sent = [peer.unicast_next.unwrap_or(0), self.multicast_next.unwrap_or(0)];
        // What an earlier life was sent, this one learns from states. What it is asked for stays.
        peer.forget_numbers();
        *peer = Peer { is_gone: false, life: incarnation, confirmed: sent, ..*peer };
        self.wanted.retain(|wanted| wanted.by != craft);
        self.said.retain(|said| said.by != craft);
        true
    }

    /// `craft` is gone in its life `incarnation`; says whether that is news.
    pub(in crate::craft) fn down(&mut self, craft: CraftId, incarnation: u32) -> bool {
        let Some(peer) = self.peers.get_mut(craft.index()) else { return false };
        if craft == self.own || incarnation < peer.life || peer.is_gone {
            return false;
        }
        peer.rest();
        (peer.is_gone, peer.life) = (true, incarnation);
        self.wanted.retain(|wanted| wanted.by != craft);
        self.gone.push(craft);
        true
    }
}
