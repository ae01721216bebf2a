//! Who trains and who is held out: trajectories dealt out group by group, so that every group is seen in training.

use augsim_data::random_stream;
use rand::RngExt;

/// The trajectories of each group in random order; `group_of` numbers the groups from 0.
fn shuffled(group_of: &[usize], among: &[usize], seed: u64, purpose: &str) -> Vec<Vec<usize>> {
    let mut rng = random_stream(seed, purpose, 0);
    let groups = group_of.iter().max().map_or(0, |last| last + 1);
    (0..groups)
        .map(|group| {
            let mut members: Vec<usize> = among.iter().copied().filter(|&j| group_of[j] == group).collect();
            for i in (1..members.len()).rev() {
                members.swap(i, rng.random_range(0..=i));
            }
            members
        })
        .collect()
}

/// Deals the trajectories `among` out to training, which gets `share`, and test; each in order.
pub(crate) fn split(group_of: &[usize], among: &[usize], share: f64, seed: u64) -> (Vec<usize>, Vec<usize>) {
    let (mut train, mut test) = (Vec::new(), Vec::new());
    let mut owed = 0.0;
    let groups = shuffled(group_of, among, seed, "discovery split");
    let single = groups.len() == 1;
    for members in groups {
        // Rounding is carried from group to group, so that the whole keeps the share; every group has one in training.
        owed += share * members.len() as f64;
        let most = if single { members.len() - 1 } else { members.len() };
        let take = (owed.round().max(0.0) as usize).clamp(1.min(most), most);
        owed -= take as f64;
        train.extend(&members[..take]);
        test.extend(&members[take..]);
    }
    if test.is_empty()
        && let Some(last) = train.pop()
    {
        test.push(last);
    }
    train.sort_unstable();
    test.sort_unstable();
    (train, test)
}

/// Deals all trajectories out to folds. The only trajectory of a group is in none: without it nothing is known of the group.
pub(crate) fn folds(group_of: &[usize], folds: usize, seed: u64) -> Vec<Vec<usize>> {
    let everything: Vec<usize> = (0..group_of.len()).collect();
    let mut out = vec![Vec::new(); folds];
    let groups = shuffled(group_of, &everything, seed, "discovery folds");
    let dealt = groups.iter().filter(|members| members.len() > 1).flatten();
    dealt.enumerate().for_each(|(i, &j)| out[i % folds].push(j));
    out.iter_mut().for_each(|fold| fold.sort_unstable());
    out
}
