// Independent rollouts over threads: each has its own data, so the bits do not depend on the count.
#pragma once

#include <condition_variable>
#include <cstddef>
#include <exception>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

#include "run/rollout.hpp"

namespace hexapod {

// Rollouts begin when they are added. They advance in slices, the one with the most samples to go
// first, so that all threads end together whatever the number and length of the rollouts.
class Batch {
 public:
  // So many threads at a time, the caller of `finish` being one of them; fewer where the system
  // refuses to start one.
  explicit Batch(int threads);
  ~Batch();  // abandons what is not finished
  Batch(const Batch&) = delete;
  Batch& operator=(const Batch&) = delete;

  void add(Rollout* rollout, long samples);  // the rollout must outlive the batch

  // Works until every rollout is done; of each: true, or false where it has diverged. Rethrows the
  // first exception of a rollout.
  std::vector<bool> finish();

 private:
  struct Job {
    Rollout* rollout;
    long left, slice;  // samples
    bool running = false, good = true;
    std::exception_ptr failure;
  };
  static constexpr long kSlices = 16, kShortestSlice = 32, kLongestSlice = 256;  // -; samples

  void work(bool leave_when_idle);
  Job* next_job();        // the longest that nobody works on; nullptr: none. Locked.
  void advance(Job& job, std::unique_lock<std::mutex>& lock);

  std::vector<std::unique_ptr<Job>> jobs_;
  std::mutex mutex_;
  std::condition_variable changed_;
  bool stopping_ = false;
  std::vector<std::thread> pool_;
};

}  // namespace hexapod
