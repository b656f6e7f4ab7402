#include "run/batch.hpp"

#include <algorithm>
#include <system_error>

namespace hexapod {

Batch::Batch(int threads) : window_(std::size_t(std::max(threads, 1)) + 1) {
  pool_.reserve(std::size_t(std::max(threads, 1)));
  try {
    for (int k = 1; k < threads; ++k) pool_.emplace_back([this] { work(); });
  } catch (const std::system_error&) {  // no more threads to be had: those that started will do
  }
}

Batch::~Batch() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    stopping_ = true;
  }
  changed_.notify_all();
  for (std::thread& thread : pool_) thread.join();
}

void Batch::add(Rollout* rollout, long samples) {
  rollout->samples().reserve(std::size_t(std::max(samples, 0L)));
  auto job = std::make_unique<Job>();
  job->rollout = rollout;
  job->left = samples;
  job->slice = std::clamp(samples / kSlices, kShortestSlice, kLongestSlice);
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    job->number = long(jobs_.size());
    if (samples <= 0) done_.push_back(job->number);
    jobs_.push_back(std::move(job));
  }
  changed_.notify_one();
}

std::pair<long, bool> Batch::next_done() {
  std::unique_lock<std::mutex> lock(mutex_);
  while (returned_ < jobs_.size()) {
    if (!done_.empty()) {
      const Job& job = *jobs_[std::size_t(done_.front())];
      done_.pop_front();
      ++returned_;
      if (job.failure) std::rethrow_exception(job.failure);
      return {job.number, job.good};
    }
    if (Job* job = next_job())
      advance(*job, lock);
    else
      changed_.wait(lock);
  }
  return {-1, true};
}

Batch::Job* Batch::next_job() {
  while (first_unfinished_ < jobs_.size() && jobs_[first_unfinished_]->left <= 0) ++first_unfinished_;
  Job* longest = nullptr;
  std::size_t seen = 0;
  for (std::size_t k = first_unfinished_; k < jobs_.size() && seen < window_; ++k) {
    Job& job = *jobs_[k];
    if (job.left <= 0) continue;
    ++seen;
    if (!job.running && (longest == nullptr || job.left > longest->left)) longest = &job;
  }
  return longest;
}

void Batch::advance(Job& job, std::unique_lock<std::mutex>& lock) {
  const long samples = std::min(job.slice, job.left);
  job.running = true;
  lock.unlock();
  bool good = false;
  std::exception_ptr failure;
  try {
    good = job.rollout->advance(samples);
  } catch (...) {
    failure = std::current_exception();
  }
  lock.lock();
  job.running = false;
  job.good = good;
  job.failure = failure;
  job.left = good ? job.left - samples : 0;
  if (job.left > 0) return;  // this thread takes what it has left, or another job
  done_.push_back(job.number);
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
