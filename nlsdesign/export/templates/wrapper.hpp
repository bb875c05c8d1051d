// C++ class around @name@.h: one object is one running instance.
#ifndef @NAME@_HPP
#define @NAME@_HPP

#include <cstdint>

#include "@name@.h"

class @class@ {
public:
    using inputs_type = @name@_inputs;
    using outputs_type = @name@_outputs;
    using parameters_type = @name@_parameters;

    static constexpr @real@ sample_time = @NAME@_SAMPLE_TIME;

    @class@() noexcept { status_ = @name@_init(&state_, nullptr); }
    explicit @class@(const parameters_type &parameters) noexcept { status_ = @name@_init(&state_, &parameters); }

    // Begins anew with the next usable readings.
    void restart() noexcept
    {
        const parameters_type kept = state_.parameters;
        status_ = @name@_init(&state_, &kept);
        clock_ = @name@_clock{};
    }

    // One sample; the outputs are finite whatever comes in.
    const outputs_type &step(const inputs_type &inputs) noexcept
    {
        status_ = @name@_step(&state_, &inputs, &outputs_);
        return outputs_;
    }

    // The same with the time in us at which the inputs were read: late and repeated samples are flagged.
    const outputs_type &step(const inputs_type &inputs, std::uint32_t microseconds) noexcept
    {
        status_ = @name@_step_at(&clock_, &state_, &inputs, &outputs_, microseconds);
        return outputs_;
    }

    std::uint32_t set_parameters(const parameters_type &parameters) noexcept
    {
        return @name@_set_parameters(&state_, &parameters);
    }

    std::uint32_t status() const noexcept { return status_; }
    const outputs_type &outputs() const noexcept { return outputs_; }

private:
    @name@_state state_{};
    outputs_type outputs_{};
    @name@_clock clock_{};
    std::uint32_t status_ = 0;
};

#endif
