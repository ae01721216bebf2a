//! Calls an external function for the lanes of a block.

use crate::compile::ExternalCall;
use crate::external::ExternalFunction;

/// Computes the results of one call in all lanes.
///
/// Lanes with the arguments of the lane before them, such as those beyond the windows of a block, are not computed again.
pub(super) fn call<const L: usize>(
    function: &ExternalFunction,
    call: &ExternalCall,
    registers: &mut [[f64; L]],
) {
    let mut points = 0;
    let mut point_of_lane = [0; L];
    let mut lane_of_point = [0; L];
    for lane in 0..L {
        let is_repeated = lane > 0
            && call.arguments.iter().all(|register| {
                let argument = &registers[*register as usize];
                argument[lane].to_bits() == argument[lane - 1].to_bits()
            });
        if !is_repeated {
            lane_of_point[points] = lane;
            points += 1;
        }
        point_of_lane[lane] = points - 1;
    }
    let mut arguments = Vec::with_capacity(points * call.arguments.len());
    for register in &call.arguments {
        let argument = &registers[*register as usize];
        arguments.extend(lane_of_point[..points].iter().map(|lane| argument[*lane]));
    }
    let found = function.evaluate(points, &arguments, &call.wanted);
    for (state, register) in &call.rates {
        let row = &found.rates[state * points..][..points];
        registers[*register as usize] = std::array::from_fn(|lane| row[point_of_lane[lane]]);
    }
    for (state, wanted, register) in &call.derivatives {
        let row = &found.derivatives[(state * call.wanted.len() + wanted) * points..][..points];
        registers[*register as usize] = std::array::from_fn(|lane| row[point_of_lane[lane]]);
    }
}
