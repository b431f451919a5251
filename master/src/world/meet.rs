//! The ranks look at each other before anything runs: whether all read the same and can do it, and which instruction path all of them have.

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use terramech_simd::Isa;

use super::{Broken, Message, World};
use crate::exit::ExitCode;

/// What a rank shows.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Card {
    /// Hash of all that went into the run.
    fingerprint: String,
    /// Its instruction path.
    isa: String,
    /// Why it cannot run: for a person.
    fault: Option<(String, ExitCode)>,
}

impl Card {
    /// Of a rank that has read everything (`Ok`: what identifies it), or found it wrong.
    pub fn of(read: &Result<Vec<(String, String)>, (String, ExitCode)>) -> Self {
        let chosen = Isa::chosen();
        let fault = read.as_ref().err().cloned();
        let fault = fault.or(chosen.as_ref().err().map(|e| (e.to_string(), ExitCode::Environment)));
        let mut hash = Sha256::new();
        hash.update(env!("CARGO_PKG_VERSION"));
        for (name, value) in read.iter().flatten() {
            // With their lengths, so that no two lists read the same.
            hash.update((name.len() as u64).to_le_bytes());
            hash.update(name);
            hash.update((value.len() as u64).to_le_bytes());
            hash.update(value);
        }
        let fingerprint = hash.finalize().iter().map(|b| format!("{b:02x}")).collect();
        Self { fingerprint, isa: chosen.map(|i| i.name().to_owned()).unwrap_or_default(), fault }
    }
}

/// What all ranks learn: the path that all of them have, or that nothing runs.
type Verdict = Result<String, ExitCode>;

/// All ranks show their cards. Gives the instruction path to take; the lowest of all.
///
/// # Errors
/// On rank 0 what is wrong, on the others an empty text; with the exit code for all.
pub fn meet(world: &mut dyn World, card: &Card) -> Result<Isa, (String, ExitCode)> {
    let lost = |e: Broken| (format!("the ranks cannot reach each other: {e}"), ExitCode::Environment);
    let size = world.size();
    let json = |card: &Card| serde_json::to_vec(card).unwrap_or_default();
    let (verdict, told): (Verdict, String) = if world.rank() == 0 {
        let mut into: Vec<Message> = (1..size).map(|r| (r, Vec::new())).collect();
        world.round(&[], &mut into, None).map_err(lost)?;
        let mut cards = vec![Some(card.clone())];
        cards.extend(into.iter().map(|(_, bytes)| serde_json::from_slice(bytes).ok()));
        let judged = judge(&cards);
        let verdict = judged.as_ref().map(|isa| isa.name().to_owned()).map_err(|(_, code)| *code);
        let bytes = serde_json::to_vec(&verdict).unwrap_or_default();
        let out: Vec<Message> = (1..size).map(|r| (r, bytes.clone())).collect();
        world.round(&out, &mut [], None).map_err(lost)?;
        (verdict, judged.err().map(|(text, _)| text).unwrap_or_default())
    } else {
        world.round(&[(0, json(card))], &mut [], None).map_err(lost)?;
        let mut into = [(0, Vec::new())];
        world.round(&[], &mut into, None).map_err(lost)?;
        (serde_json::from_slice(&into[0].1).unwrap_or(Err(ExitCode::Environment)), String::new())
    };
    let name = verdict.map_err(|code| (told, code))?;
    name.parse().map_err(|_| (format!("no instruction path \"{name}\" here"), ExitCode::Environment))
}

/// What rank 0 makes of all cards, in the order of the ranks.
fn judge(cards: &[Option<Card>]) -> Result<Isa, (String, ExitCode)> {
    let mut lowest = Isa::Avx512;
    let mut others = Vec::new();
    for (rank, card) in cards.iter().enumerate() {
        let Some(card) = card else {
            return Err((format!("rank {rank} runs another program"), ExitCode::Environment));
        };
        match (&card.fault, rank) {
            // Most often all ranks say the same: it is told once.
            (Some((text, code)), 0) => return Err((text.clone(), *code)),
            (Some((text, code)), _) => return Err((format!("rank {rank}: {text}"), *code)),
            (None, _) => {}
        }
        if cards[0].as_ref().is_some_and(|first| first.fingerprint != card.fingerprint) {
            others.push(rank.to_string());
        }
        lowest = card.isa.parse().map_or(lowest, |isa| lowest.min(isa));
    }
    if others.is_empty() {
        return Ok(lowest);
    }
    let (ranks, read) = if others.len() == 1 { ("rank", "reads") } else { ("ranks", "read") };
    Err((
        format!(
            "{ranks} {} {read} other files or was given another command than rank 0: description, specifications, FMUs, tables and the program must be the same everywhere",
            others.join(", ")
        ),
        ExitCode::Input,
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    type Told<T> = Result<T, (String, ExitCode)>;

    fn meeting(cards: Vec<Told<Vec<(String, String)>>>) -> Vec<Told<Isa>> {
        let ranks: Vec<_> = super::super::threads(cards.len())
            .into_iter()
            .zip(cards)
            .map(|(mut world, card)| std::thread::spawn(move || meet(world.as_mut(), &Card::of(&card))))
            .collect();
        ranks.into_iter().map(|r| r.join().unwrap()).collect()
    }

    #[test]
    fn ranks_that_read_the_same_agree() {
        let same = || Ok(vec![("system.ssd".into(), "abc".into())]);
        let isa = Isa::chosen().unwrap();
        assert_eq!(meeting(vec![same(), same(), same()]), vec![Ok(isa); 3]);
    }

    #[test]
    fn other_files_and_faults_are_told_once_and_end_all() {
        let of = |hash: &str| Ok(vec![("system.ssd".to_owned(), hash.to_owned())]);
        let met = meeting(vec![of("a"), of("a"), of("b")]);
        let (told, code) = met[0].clone().unwrap_err();
        assert!(told.contains("rank 2 reads other files") && code == ExitCode::Input, "{told}");
        assert_eq!(met[1], Err((String::new(), ExitCode::Input)));
        let met = meeting(vec![of("a"), Err(("x.ssd: no such file".into(), ExitCode::Input))]);
        assert_eq!(met[0].clone().unwrap_err().0, "rank 1: x.ssd: no such file");
    }
}
