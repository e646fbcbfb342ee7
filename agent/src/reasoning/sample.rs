//! Random boards for tests.

use shared_types::ids::FactId;
use shared_types::knowledge::{BoardNetwork, Literal};
use shared_types::rng::Stream;

/// How large, and whether literals may be negated.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shape {
    pub(crate) facts: u32,
    pub(crate) rules: u32,
    pub(crate) actions: u32,
    pub(crate) associations: u32,
    pub(crate) is_negating: bool,
}

/// A board of `shape`: up to `associations - 1` premises, triggers and outputs each; a third of the
/// triggers are actions; three in ten facts hold at the start.
pub(crate) fn board(shape: Shape, stream: &mut Stream) -> BoardNetwork {
    let most = shape.associations - 1;
    let mut board = BoardNetwork { fact_count: shape.facts, ..BoardNetwork::default() };
    let literal = |stream: &mut Stream| {
        let fact = FactId(stream.below(shape.facts));
        let is_negated = shape.is_negating && stream.below(4) == 0;
        if is_negated { Literal::is_absent(fact).0 } else { Literal::holds(fact).0 }
    };
    for _ in 0..shape.rules {
        let premises: Vec<u32> = (0..stream.between(1, most)).map(|_| literal(stream)).collect();
        board.premises.push_row(premises);
        for _ in 0..stream.between(1, most) {
            if shape.actions > 0 && stream.below(3) == 0 {
                board.queues.push_item(stream.below(shape.actions));
            } else {
                board.outputs.push_item(literal(stream));
            }
        }
        board.outputs.finish_row();
        board.queues.finish_row();
    }
    for _ in 0..shape.actions {
        let outputs: Vec<u32> = (0..stream.between(0, most)).map(|_| literal(stream)).collect();
        board.action_outputs.push_row(outputs);
    }
    for fact in 0..shape.facts {
        if stream.below(10) < 3 {
            board.initial.push(fact);
        }
        board.links.push_row([]);
    }
    board.index_readers();
    board
}
