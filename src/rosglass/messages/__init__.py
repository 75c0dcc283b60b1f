"""What a message is: lazy trees over received bytes, and the codecs behind them."""
