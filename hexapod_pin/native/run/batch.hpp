// Independent rollouts over threads: each has its own data, so the bits do not depend on the count.
#pragma once

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <exception>
#include <memory>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

#include "run/rollout.hpp"

namespace hexapod {

// Rollouts begin when they are added. Of the first unfinished ones, one more than there are threads,
// the one with the most samples to go advances by a slice: results come early, and all threads end
// together whatever the number and length of the rollouts.
class Batch {
 public:
  // So many threads at a time, the caller of `next_done` being one of them; fewer where the system
  // refuses to start one.
  explicit Batch(int threads);
  ~Batch();  // abandons what is not finished
  Batch(const Batch&) = delete;
  Batch& operator=(const Batch&) = delete;

  void add(Rollout* rollout, long samples);  // the rollout must outlive the batch

  // Works until a rollout is done that was not returned yet: its number, and whether it has not
  // diverged; -1 after the last. Rethrows an exception of that rollout.
  std::pair<long, bool> next_done();

 private:
  struct Job {
    long number;
    Rollout* rollout;
    long left, slice;  // samples
    bool running = false, good = true;
    std::exception_ptr failure;
  };
  static constexpr long kSlices = 16, kShortestSlice = 32, kLongestSlice = 256;  // -; samples

  void work();  // of the pool's threads
  // With the mutex locked:
  Job* next_job();  // nullptr: nothing that a thread could take
  void advance(Job& job, std::unique_lock<std::mutex>& lock);

  std::vector<std::unique_ptr<Job>> jobs_;
  std::deque<long> done_;  // numbers of jobs not returned yet
  std::size_t first_unfinished_ = 0, returned_ = 0, window_;
  std::mutex mutex_;
  std::condition_variable changed_;
  bool stopping_ = false;
  std::vector<std::thread> pool_;
};

}  // namespace hexapod
