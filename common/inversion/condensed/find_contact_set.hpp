// SPDX-License-Identifier: GPL-3.0-or-later
// find_contact_set(): the loop that both condensed methods search their contact set with. The rule
// from one set to the next is that of contact/set_search.hpp; the method solves for each set.
#pragma once

#include <stop_token>

#include "common/contact/set_search.hpp"
#include "common/core/error.hpp"
#include "common/inversion/contract/inversion_options.hpp"

namespace brainshift::inversion {

enum class SearchEnd {
  kSolved,     // contact holds to the tolerance of the search
  kExhausted,  // limit on iterations, or no gain in a cycle: the method holds the best set
  kDeadline,   // the method is out of time: it holds the best set
};

// Method has
//   Status evaluate(const contact::ActiveSet&)   solution for that set, written to its history
//   all_forces(), penetration(), compliance_diagonal()   of that solution, one per slave
//   void keep()          the search goes on to a new set: last chance to keep this solution
//   void leave_cycle()   the sets repeat: chooses the next set by search.follow() or search.pivot()
//   bool out_of_time() const
// On return the method holds the solution of the set that the search ended with. Errors of
// evaluate(); stopped(), looked at before every set.
template <typename Method>
Result<SearchEnd> find_contact_set(contact::SetSearch& search, Method& method,
                                   const std::stop_token& stop) {
  search.begin();
  SearchEnd end = SearchEnd::kSolved;
  bool searching = true;
  while (searching) {
    if (stop.stop_requested()) return stopped(search.iteration() + 1);
    if (auto status = method.evaluate(search.current()); !status) {
      return tl::unexpected(status.error());
    }
    switch (search.next(method.all_forces(), method.penetration(), method.compliance_diagonal())) {
      case contact::SetSearch::Step::kSolved: return SearchEnd::kSolved;
      case contact::SetSearch::Step::kExhausted:
        end = SearchEnd::kExhausted;
        searching = false;
        break;
      case contact::SetSearch::Step::kContinue: method.keep(); break;
      case contact::SetSearch::Step::kCycling: method.leave_cycle(); break;
    }
    if (searching && method.out_of_time()) {
      end = SearchEnd::kDeadline;
      searching = false;
    }
  }
  // The best set seen, evaluated once more.
  if (auto status = method.evaluate(search.best()); !status) {
    return tl::unexpected(status.error());
  }
  search.adopt_best();
  return end;
}

}  // namespace brainshift::inversion
