// Independent rollouts over threads: each has its own data, so the bits do not depend on the count.
#pragma once

#include <atomic>
#include <exception>
#include <thread>
#include <vector>

#include "run/rollout.hpp"

namespace hexapod {

// good[i] = what rollouts[i]->advance(samples[i]) returned
inline std::vector<char> advance_all(const std::vector<Rollout*>& rollouts,
                                     const std::vector<long>& samples, int threads) {
  std::vector<char> good(rollouts.size(), 0);
  std::vector<std::exception_ptr> failures(rollouts.size());
  std::atomic<std::size_t> next{0};
  auto work = [&] {
    for (std::size_t i; (i = next.fetch_add(1)) < rollouts.size();) {
      try {
        good[i] = rollouts[i]->advance(samples[i]);
      } catch (...) {
        failures[i] = std::current_exception();
      }
    }
  };
  std::vector<std::thread> pool;
  for (int k = 1; k < threads; ++k) pool.emplace_back(work);
  work();
  for (std::thread& thread : pool) thread.join();
  for (const std::exception_ptr& failure : failures)
    if (failure) std::rethrow_exception(failure);
  return good;
}

}  // namespace hexapod
