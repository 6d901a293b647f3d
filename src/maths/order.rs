//! An order in which each item comes after all that it needs.

/// The order, and the circles that make a whole order impossible.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Order {
    /// Every item once; what lies outside of circles comes after all that it needs.
    pub items: Vec<usize>,
    /// Items that need each other, each the one after it and the last the first. No item is in two.
    pub circles: Vec<Vec<usize>>,
}

/// `needs[i]` are the items that item `i` needs. Chains may be long: nothing here calls itself.
pub fn order(needs: &[Vec<usize>]) -> Order {
    let mut order = Order::default();
    let mut is_begun = vec![false; needs.len()];
    let mut is_done = vec![false; needs.len()];
    let mut is_in_circle = vec![false; needs.len()];
    let mut open: Vec<(usize, usize)> = Vec::new();
    for first in 0..needs.len() {
        if !std::mem::replace(&mut is_begun[first], true) {
            open.push((first, 0));
        }
        while let Some((item, n_seen)) = open.last_mut() {
            let Some(&next) = needs[*item].get(*n_seen) else {
                order.items.push(*item);
                is_done[*item] = true;
                open.pop();
                continue;
            };
            *n_seen += 1;
            if !std::mem::replace(&mut is_begun[next], true) {
                open.push((next, 0));
            } else if !is_done[next] && !is_in_circle[next] {
                let start = open.iter().position(|(item, _)| *item == next).unwrap_or(0);
                let circle: Vec<usize> = open[start..].iter().map(|(item, _)| *item).collect();
                if !circle.iter().any(|&item| is_in_circle[item]) {
                    circle.iter().for_each(|&item| is_in_circle[item] = true);
                    order.circles.push(circle);
                }
            }
        }
    }
    order
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_needed_comes_first_whatever_the_numbers() {
        let needs = vec![vec![2, 1], vec![3], vec![1], vec![], vec![0]];
        assert_eq!(order(&needs), Order { items: vec![3, 1, 2, 0, 4], circles: vec![] });
    }

    #[test]
    fn circles_are_told_once_and_leave_the_rest_in_order() {
        // 0 needs itself; 1, 2 and 3 need each other, 2 and 3 twice over; 4 needs 1 and 5.
        let needs = vec![vec![0], vec![2], vec![3], vec![1, 2], vec![1, 5], vec![]];
        let order = order(&needs);
        assert_eq!(order.circles, [vec![0], vec![1, 2, 3]]);
        assert_eq!(order.items, [0, 3, 2, 1, 5, 4]);
    }

    #[test]
    fn a_long_chain_needs_no_stack() {
        let n_items = 200_000;
        let needs: Vec<Vec<usize>> =
            (0..n_items).map(|item| if item + 1 < n_items { vec![item + 1] } else { vec![] }).collect();
        let items: Vec<usize> = (0..n_items).rev().collect();
        assert_eq!(order(&needs), Order { items, circles: vec![] });
    }
}
