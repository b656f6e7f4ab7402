// Independent rollouts over threads: each has its own data, so the bits do not depend on the count.
#pragma once

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <memory>
#include <mutex>
#include <string>

#include "run/rollout.hpp"
#include "run/thread_team.hpp"

namespace hexapod {

// Rollouts begin when they are added. Of the first unfinished ones, one more than there are threads,
// the one with the most samples to go advances by a slice: results come early, and all threads end
// together whatever the number and length of the rollouts. A rollout that is done is not touched again.
class Batch {
 public:
  static constexpr long kNone = -1, kNotYet = -2;  // instead of a number

  struct Done {
    long number;
    bool good = true;     // has not diverged
    std::string failure;  // message of an exception
  };

  // So many threads at a time, the caller of `next_done` being one of them. Throws where the system
  // refuses to start one.
  explicit Batch(int threads);
  ~Batch();  // ends what is not finished
  Batch(const Batch&) = delete;
  Batch& operator=(const Batch&) = delete;

  // Returns its number: 0, 1, 2, ... The rollout must live until `next_done` has returned it, or
  // until the batch ends. `slice`: samples to advance by at a time.
  long add(Rollout* rollout, long samples, long slice);

  // Works until a rollout is done that was not returned yet. kNone after the last; kNotYet when
  // `patience` [s] is over and a slice at its end.
  Done next_done(double patience);

 private:
  struct Job {
    long number;
    Rollout* rollout;
    long left, slice;  // samples
    bool running = false, good = true;
    std::string failure;
  };

  void work();  // of the pool's threads
  void stop();
  // With the mutex locked:
  Job* next_job();  // nullptr: nothing that a thread could take
  void advance(Job& job, std::unique_lock<std::mutex>& lock);

  std::deque<std::unique_ptr<Job>> jobs_;  // not done yet, in order of their numbers
  std::deque<std::unique_ptr<Job>> done_;  // not returned yet
  long added_ = 0;
  std::size_t window_;
  std::mutex mutex_;
  std::condition_variable changed_;
  bool stopping_ = false;
  ThreadTeam pool_;
};

}  // namespace hexapod
