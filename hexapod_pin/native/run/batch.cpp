#include "run/batch.hpp"

#include <algorithm>
#include <chrono>
#include <exception>
#include <utility>

namespace hexapod {

Batch::Batch(int threads) : window_(std::size_t(std::max(threads, 1)) + 1) {
  try {
    pool_.begin(threads - 1, [this] { work(); });
  } catch (...) {
    stop();
    throw;
  }
}

Batch::~Batch() { stop(); }

void Batch::stop() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    stopping_ = true;
    for (const std::unique_ptr<Job>& job : jobs_) job->rollout->monitor().stop();
  }
  changed_.notify_all();
  pool_.join();
}

long Batch::add(Rollout* rollout, long samples, long slice) {
  auto job = std::make_unique<Job>();
  job->rollout = rollout;
  job->left = samples;
  job->slice = std::max(slice, 1L);
  const std::lock_guard<std::mutex> lock(mutex_);
  const long number = job->number = added_++;
  (samples > 0 ? jobs_ : done_).push_back(std::move(job));
  changed_.notify_one();
  return number;
}

Batch::Done Batch::next_done(double patience) {
  using Clock = std::chrono::steady_clock;
  const auto end = Clock::now() + std::chrono::duration_cast<Clock::duration>(
                                      std::chrono::duration<double>(patience));
  std::unique_lock<std::mutex> lock(mutex_);
  while (done_.empty()) {
    if (jobs_.empty()) return {kNone, true, {}};
    if (Clock::now() >= end) return {kNotYet, true, {}};
    if (Job* job = next_job())
      advance(*job, lock);
    else
      changed_.wait_until(lock, end);
  }
  const std::unique_ptr<Job> job = std::move(done_.front());
  done_.pop_front();
  return {job->number, job->good, job->failure};
}

Batch::Job* Batch::next_job() {
  Job* longest = nullptr;
  const std::size_t seen = std::min(window_, jobs_.size());
  for (std::size_t k = 0; k < seen; ++k) {
    Job& job = *jobs_[k];
    if (!job.running && (longest == nullptr || job.left > longest->left)) longest = &job;
  }
  return longest;
}

void Batch::advance(Job& job, std::unique_lock<std::mutex>& lock) {
  const long samples = std::min(job.slice, job.left);
  job.running = true;
  lock.unlock();
  bool good = false;
  std::string failure;
  try {
    good = job.rollout->advance(samples);
  } catch (const std::exception& error) {
    failure = error.what();
  } catch (...) {
    failure = "unknown failure of the core";
  }
  lock.lock();
  job.running = false;
  job.good = good;
  job.failure = failure;
  job.left = good ? job.left - samples : 0;
  if (job.left > 0) return;  // this thread takes what it has left, or another job
  const auto found = std::find_if(jobs_.begin(), jobs_.end(),
                                  [&](const std::unique_ptr<Job>& j) { return j.get() == &job; });
  done_.push_back(std::move(*found));
  jobs_.erase(found);
  changed_.notify_all();
}

void Batch::work() {
  std::unique_lock<std::mutex> lock(mutex_);
  while (!stopping_) {
    if (Job* job = next_job())
      advance(*job, lock);
    else
      changed_.wait(lock);
  }
}

}  // namespace hexapod
